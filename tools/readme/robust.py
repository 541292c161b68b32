"""The table of the ablation of randomized training: success rate by group of perturbations."""

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.robust import ALL_KINDS, ARMS
from benchmarks.robust_comparison import PLAIN, mean
from drone_rl.trust.axes import GROUPS
from tools.readme.tables import UNKNOWN

_UNTOUCHED = "untouched"


def make_robust(figures: Mapping[str, Any]) -> str:
    """Return a Markdown table with a row for each group and a column for each arm."""
    measured, untouched = figures.get("robust_arms", {}), figures.get("robust_untouched", ())
    names = [PLAIN, *GROUPS, _UNTOUCHED, ALL_KINDS]
    lines = [_line(["success rate, %", *ARMS]), _line(["---"] * (1 + len(ARMS)))]
    for name in names:
        cells = [_cell(measured.get(arm, {}).get(name)) for arm in ARMS]
        lines.append(_line([_title(name, untouched), *cells]))
    return "\n".join(lines)


def _title(name: str, untouched: Sequence[str]) -> str:
    if name == PLAIN:
        return "training conditions"
    if name == _UNTOUCHED:
        return "**mean of the groups without randomization**"
    if name == ALL_KINDS:
        return "mean of all groups"
    return f"**{name}**" if name in untouched else name


def _cell(rates: Sequence[float] | None) -> str:
    """Format the mean, minimum and maximum over seeds."""
    if not rates:
        return UNKNOWN
    low, middle, high = (100 * rate for rate in (min(rates), mean(rates), max(rates)))
    return f"{middle:.0f} ({low:.0f} to {high:.0f})"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
