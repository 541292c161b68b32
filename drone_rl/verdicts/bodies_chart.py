"""Policies in several bodies as a table in colours: what became of each verdict."""

import textwrap
from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drone_rl.robustness.sitl_text import LOOPED
from drone_rl.robustness.sitl_text import looped as said
from drone_rl.verdicts.bodies_text import failure

_COLORS = {"good": "#b9e0b0", "poor": "#f2b5ad", "one-sided": "#f7d7a0", "none": "#e3e6ea"} | {
    "good, but trivial": "#dfe7bd"
}
_INK, _FAINT = "#1e2024", "#5b616b"
_WIDTH, _HEIGHT = 1.75, 0.95
"""Inches of a cell."""


def chart(numbers: Mapping[str, Any]) -> Figure:
    """A row a policy, a column a body: verdict, share with 95% interval, what fails most.

    Args:
        numbers: As in `bodies.json`.
    """
    policies = numbers["policies"]
    looped = numbers.get(LOOPED, {})
    bodies = [*numbers["bodies"], *([LOOPED] if looped else [])]
    size = (_WIDTH * (len(bodies) + 1), _HEIGHT * len(policies) + 0.6)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(-1, len(bodies)), ylim=(len(policies), -0.55))
    axes.axis("off")
    for x, body in enumerate(bodies):
        axes.text(x + 0.5, -0.25, body, ha="center", va="center", fontsize=10, color=_INK)
    for y, (name, flown) in enumerate(policies.items()):
        axes.text(-0.05, y + 0.5, name, ha="right", va="center", fontsize=11, color=_INK)
        for x, body in enumerate(numbers["bodies"]):
            _cell(axes, x, y, flown[body])
        if looped:
            _looped_cell(axes, len(bodies) - 1, y, looped[name])
    return figure


def _looped_cell(axes: Axes, x: int, y: int, flights: Mapping[str, Any]) -> None:
    box = {"facecolor": _COLORS["none"], "edgecolor": "white", "linewidth": 2, "hatch": ".."}
    axes.add_patch(Rectangle((x, y), 1, 1, **box))
    text, ink = textwrap.fill(said(flights), 22), _INK
    axes.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=8.0, color=ink)


def _cell(axes: Axes, x: int, y: int, verdict: Mapping[str, Any]) -> None:
    kind = verdict["kind"]
    color = _COLORS.get(kind) or _COLORS.get(kind.split()[0], _COLORS["none"])
    box = {"facecolor": color, "edgecolor": "white", "linewidth": 2}
    axes.add_patch(Rectangle((x, y), 1, 1, **box))
    success, unsure = verdict["greedy"]["success"], "" if verdict["certain"] else " ?"
    share = f"{100 * success['share']:.1f}%"
    ends = f"{100 * success['lower95']:.0f} to {100 * success['upper95']:.0f}"
    lines = (
        (0.2, f"{verdict['kind']}{unsure}", 9.0, _INK),
        (0.45, f"{share}  ({ends})", 9.5, _INK),
        (0.77, textwrap.fill(failure(verdict), 26), 7.0, _FAINT),
    )
    for height, text, points, ink in lines:
        axes.text(x + 0.5, y + height, text, ha="center", va="center", fontsize=points, color=ink)
