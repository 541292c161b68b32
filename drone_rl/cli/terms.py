"""`drone-rl terms`: list the terms that tasks can name."""

from pathlib import Path

from drone_rl.cli.settings import CommandSettings
from drone_rl.config.terms import ALL_TERMS, Terms
from drone_rl.utils.display import aligned


class TermsCommand(CommandSettings):
    """List the terms of rewards, ends, success and events that tasks can name.

    Those of your own are listed with plugins=FILE. A weight or parameter is set by
    task.reward.NAME.weight=-0.3, and likewise below the other settings.
    """

    has_folder = False

    def run(self, folder: Path) -> tuple[int, None]:
        """List the terms; return the exit status."""
        from drone_rl.sim import tasks as tasks  # registers the shipped ones; imports torch

        for setting, terms in ALL_TERMS.items():
            print(setting, aligned(_rows(terms)), "", sep="\n")
        return 0, None


def _rows(terms: Terms) -> list[list[str]]:
    """Return the name of each term, its weight and parameters by default, and its meaning."""
    return [
        [
            f"  {term.name}",
            ", ".join(f"{name}={value:g}" for name, value in term.settings()),
            term.meaning,
        ]
        for term in terms.by_name.values()
    ]
