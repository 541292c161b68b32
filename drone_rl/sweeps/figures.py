"""The plots of a sweep's report, as PNG: a panel for each choice of all settings but one."""

import dataclasses
import io
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.sweeps.rows import Row
from drone_rl.sweeps.summary import FAILED, RunGroup, median_band, on_grid
from drone_rl.trust.rule import KINDS
from drone_rl.utils.palette import BAD, FAINT, GOOD, MUTED, ONE_SIDED, css, light

FAVOURITE_AXIS = "optimizer.lr"
MAX_PANELS = 6
UNIFORM = float(np.log(len(SHOWN_MOVES.names)))
"""Entropy of the uniform distribution over the chapter's three moves, nats."""
_COLORS = map(css, (GOOD, light(GOOD), ONE_SIDED, BAD, MUTED, FAINT))
_STYLES: dict[str, dict[str, Any]] = {
    kind: {"marker": marker, "color": color}
    for kind, marker, color in zip((*KINDS, FAILED), "oDsvPX", _COLORS, strict=True)
}
"""Kinds differ in color and in marker."""
_ROUNDING = 1e-4
_LEGEND_ENTRY_INCHES = 1.5
"""Width of the longest entry of a legend."""


@dataclasses.dataclass
class Layout:
    """The setting on the x axis, and the groups of each panel."""

    axis: str | None
    """A swept setting; None if only seeds differ."""
    panels: dict[str, list[RunGroup]]
    """Groups by the values of the other settings; at most `MAX_PANELS`."""
    left_out: int = 0
    """Number of panels beyond this limit."""


def lay_out(groups: Sequence[RunGroup]) -> Layout:
    """Put the learning rate, or else the last swept setting, on the x axis."""
    keys = list(groups[0].settings) if groups else []
    axis = FAVOURITE_AXIS if FAVOURITE_AXIS in keys else (keys[-1] if keys else None)
    panels: dict[str, list[RunGroup]] = {}
    for group in groups:
        rest = [f"{key}={value}" for key, value in group.settings.items() if key != axis]
        panels.setdefault(", ".join(rest), []).append(group)
    shown = dict(list(panels.items())[:MAX_PANELS])
    return Layout(axis, shown, len(panels) - len(shown))


def draw_curves(layout: Layout) -> bytes:
    """Return the learning curves."""
    return _render(layout, [_curves], height=3.6)


def draw_outcome(layout: Layout) -> bytes:
    """Return verdicts, sides and entropies, one below the other."""
    return _render(layout, [_verdicts, _sides, _entropies], height=2.5)


def _render(layout: Layout, plots: Sequence["Plot"], height: float) -> bytes:
    """Stack a block of panels per plot: up to three panels in one row, more in rows of two."""
    panels = list(layout.panels.items())
    columns = len(panels) if 0 < len(panels) <= 3 else min(2, len(panels) or 1)
    rows = max(1, -(-len(panels) // columns))
    size = (min(5.2 * columns, 13.0), height * rows * len(plots))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows * len(plots), columns, squeeze=False, sharey="row")
    for plot, block in zip(plots, np.split(grid, len(plots)), strict=True):
        for axes, (title, groups) in zip(block.flat, panels, strict=False):
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_title(_literal(title), fontsize=10)
            plot(axes, layout, groups)
        for axes in block[:, 1:].flat:
            axes.set_ylabel("")  # the first column labels the shared axis
        for axes in block.flat[len(panels) :]:
            axes.set_visible(False)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=110)
    return file.getvalue()


def _curves(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    colors = colormaps["viridis"](np.linspace(0.1, 0.9, max(1, len(groups))))
    for group, color in zip(groups, colors, strict=True):
        end = max((row.frames for row in group.ended), default=0.0)
        if end == 0.0:
            continue
        grid = np.linspace(0, end, 120)
        values = np.stack([on_grid(*row.curve, grid) for row in group.ended])
        label = _literal(group.settings.get(layout.axis or "", "all runs"))
        band = median_band(values)
        if band is None:
            labels = [label, *["_"] * (len(values) - 1)]  # legends omit a leading underscore
            axes.plot(grid, values.T, color=color, linewidth=0.8, label=labels)
        else:
            axes.plot(grid, np.median(values, axis=0), color=color, label=label)
            axes.fill_between(grid, *band, color=color, alpha=0.2, linewidth=0)
    axes.set(xlabel="frames", ylabel="running reward / largest reward")
    axes.set_ylim(top=1.0)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(title=_literal(layout.axis or ""), fontsize=7, title_fontsize=7)


def _verdicts(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    _name_groups(axes, layout, groups)
    for i, (kind, style) in enumerate(_STYLES.items()):
        shares = [group.verdicts[kind] for group in groups]
        if any(share.successes for share in shares):
            known = [(x, s) for x, s in enumerate(shares) if s.share is not None]
            y, low, high = np.array([(s.share, s.lower95, s.upper95) for _, s in known]).T
            x = [place + 0.08 * (i - 2) for place, _ in known]
            axes.errorbar(x, y, [y - low, high - y], markersize=4, capsize=2, **style)
    axes.set(ylabel="fraction of runs", ylim=(-0.03, 1.03))


def _sides(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    _dots(axes, layout, groups, lambda row: row.lean)
    axes.axhline(0.0, color="0.5", linewidth=0.8, zorder=0)
    axes.set(ylabel="goals reached, right minus left", ylim=(-1.1, 1.1))


def _entropies(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    _dots(axes, layout, groups, lambda row: row.entropy)
    axes.set(ylabel="entropy at the end, nats")
    entropies = [r.entropy for group in groups for r in group.rows if r.entropy is not None]
    # values beyond are of other actions than the three moves
    if all(0.0 <= entropy <= UNIFORM + _ROUNDING for entropy in entropies):
        axes.axhline(UNIFORM, color="0.5", linewidth=0.8, zorder=0)
        axes.set(ylim=(-0.06, 1.06 * UNIFORM))


def _dots(
    axes: Axes, layout: Layout, groups: list[RunGroup], value: Callable[[Row], float | None]
) -> None:
    """Plot a dot per judged run, hollow if uncertain; the runs of a group are side by side."""
    _name_groups(axes, layout, groups)
    for place, group in enumerate(groups):
        judged = [(value(row), row) for row in group.ended if row.kind is not None]
        dots = [(y, row) for y, row in judged if y is not None]
        for i, (y, row) in enumerate(sorted(dots, key=lambda dot: KINDS.index(dot[1].kind))):
            x = place + min(0.05, 0.6 / len(dots)) * (i - (len(dots) - 1) / 2)
            fill: Any = "full" if row.certain else "none"
            axes.plot([x], [y], ls="", markersize=4, fillstyle=fill, **_STYLES[str(row.kind)])


def _name_groups(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    """Name each group's place on the x axis, and add one legend of kinds above the image."""
    names = [_literal(str(group.settings.get(layout.axis or "", ""))) for group in groups]
    axes.set_xlabel(_literal(layout.axis or "all runs"))
    axes.set_xticks(range(len(names)), names, rotation=20, fontsize=7)
    axes.set_xlim(-0.5, len(names) - 0.5)
    figure = axes.get_figure(root=True)
    if figure is not None and not figure.legends:
        handles = [Line2D([], [], label=kind, **style) for kind, style in _STYLES.items()]
        columns = min(len(handles), max(1, int(figure.get_figwidth() / _LEGEND_ENTRY_INCHES)))
        figure.legend(handles=handles, loc="outside upper center", ncols=columns, fontsize=8)


Plot = Callable[[Axes, Layout, list[RunGroup]], None]


def _literal(text: str) -> str:
    """Escape dollar signs, which matplotlib reads as formulas."""
    return text.replace("$", r"\$")
