"""The table that compares our learners with those of other libraries."""

from collections.abc import Mapping
from typing import Any

from benchmarks.peers.settings import LABELS, OURS, THEIRS
from tools.readme.tables import UNKNOWN

_SHOWN = {
    "seconds": ".1f",
    "seconds_without_imports": ".1f",
    "frames": ",",
    "success_lower95": ".1%",
}


def make_peers(figures: Mapping[str, Any]) -> str:
    """Return a Markdown table with one row for each learner and one value for each seed."""
    lines = [
        "| learner | settings | seconds from process start | without imports | frames | "
        "success rate, lower end of 95% CI |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, label in LABELS.items():
        measured = figures.get("peers", {}).get(name)
        cells = [UNKNOWN] * len(_SHOWN) if measured is None else _cells(measured)
        lines.append(f"| {' | '.join([label, _settings(name), *cells])} |")
    return "\n".join(lines)


def _cells(measured: Mapping[str, Any]) -> list[str]:
    cells = ["; ".join(f"{v:{spec}}" for v in measured[key]) for key, spec in _SHOWN.items()]
    unsolved = measured["is_solved"].count(False)
    return [*cells[:2], cells[2] + (f" ({unsolved} not solved)" if unsolved else ""), cells[3]]


def _settings(name: str) -> str:
    if name in OURS:
        return f"`{' '.join(['drone-rl train', *OURS[name]])}`"
    return ", ".join(f"{key} {value:g}" for key, value in THEIRS[name].items())
