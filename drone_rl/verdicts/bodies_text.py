"""The table of policies in several bodies. Evidence: `bodies.json`."""

from typing import Any

from drone_rl.robustness.sitl_text import with_loops
from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import Evidence, percent


def rows(numbers: Evidence) -> list[list[str]]:
    """Names of bodies, then a row for each policy."""
    bodies = [str(body) for body in numbers["bodies"]]
    cells = [
        [name, *(cell(flown[body]) for body in bodies)]
        for name, flown in numbers["policies"].items()
    ]
    return with_loops([["", *bodies], *cells], numbers)


def cell(verdict: Evidence) -> str:
    """A verdict in a few words: its kind and the share of successful episodes."""
    success = verdict["greedy"]["success"]
    unsure = "" if verdict["certain"] else "?"
    ends = f"{_points(success['lower95'])} to {_points(success['upper95'])}"
    return f"{verdict['kind']}{unsure} {percent(success['share'])} ({ends})"


def failure(verdict: Evidence) -> str:
    """Where most of its failures are; nothing if there is none."""
    row: dict[str, Any] | None = verdict["failures"]["largest"]
    return "" if row is None else terms_of(verdict).failing(row["by"], row["value"])


def _points(share: float) -> str:
    return f"{100 * share:.0f}"
