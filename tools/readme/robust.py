"""The table of what trainings in other worlds gain, and what each part of them does."""

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.robust import ALL_KINDS, ARMS
from benchmarks.robust_comparison import PLAIN, mean
from drone_rl.robustness.axes import GROUPS
from tools.readme.tables import UNKNOWN

_UNTOUCHED = "untouched"


def make_robust(figures: Mapping[str, Any]) -> str:
    """A table in Markdown, a line for each kind of shift; a column for each arm of the ablation."""
    measured, untouched = figures.get("robust_arms", {}), figures.get("robust_untouched", ())
    names = [PLAIN, *GROUPS, _UNTOUCHED, ALL_KINDS]
    lines = [_line(["successful flights, %", *ARMS]), _line(["---"] * (1 + len(ARMS)))]
    for name in names:
        cells = [_cell(measured.get(arm, {}).get(name)) for arm in ARMS]
        lines.append(_line([_title(name, untouched), *cells]))
    return "\n".join(lines)


def _title(name: str, untouched: Sequence[str]) -> str:
    if name == PLAIN:
        return "the world as it is"
    if name == _UNTOUCHED:
        return "**mean of the kinds that are not touched**"
    if name == ALL_KINDS:
        return "mean of all kinds"
    return f"**{name}**" if name in untouched else name


def _cell(shares: Sequence[float] | None) -> str:
    """The mean over seeds, and the least and the greatest."""
    if not shares:
        return UNKNOWN
    low, middle, high = (100 * share for share in (min(shares), mean(shares), max(shares)))
    return f"{middle:.0f} ({low:.0f} to {high:.0f})"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
