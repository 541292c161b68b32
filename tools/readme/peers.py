"""The table of our learners beside what a user would pick instead."""

from collections.abc import Mapping
from typing import Any

from benchmarks.peers.settings import LABELS, OURS, THEIRS
from tools.readme.tables import UNKNOWN

_SHOWN = {
    "seconds": ".1f",
    "seconds_without_imports": ".1f",
    "frames": ",",
    "success_lower95": ".3f",
}


def make_peers(figures: Mapping[str, Any]) -> str:
    """A table in Markdown, a line for each; lists are by seed."""
    lines = [
        "| who | settings | seconds from the start of the process | without imports | frames | "
        "success, lower end |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, label in LABELS.items():
        measured = figures.get("peers", {}).get(name)
        cells = [UNKNOWN] * len(_SHOWN) if measured is None else _cells(measured)
        lines.append(f"| {' | '.join([label, _settings(name), *cells])} |")
    return "\n".join(lines)


def _cells(measured: Mapping[str, Any]) -> list[str]:
    cells = ["; ".join(f"{v:{how}}" for v in measured[key]) for key, how in _SHOWN.items()]
    unsolved = measured["is_solved"].count(False)
    return [*cells[:2], cells[2] + (f" ({unsolved} not solved)" if unsolved else ""), cells[3]]


def _settings(name: str) -> str:
    if name in OURS:
        return f"`{' '.join(['drone-rl train', *OURS[name]])}`"
    return ", ".join(f"{key} {value:g}" for key, value in THEIRS[name].items())
