"""The plots of a sweep's report, each as PNG bytes for a light and a dark page."""

import dataclasses
import io
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps, style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.sweeps.rows import Row
from drone_rl.sweeps.summary import FAILED, RunGroup, median_band, on_grid
from drone_rl.trust.rule import KINDS
from drone_rl.utils.palette import BAD, FAINT, GOOD, MUTED, ONE_SIDED, css, light

FAVOURITE_AXIS = "optimizer.lr"
COLORS = {
    "good": css(GOOD),
    "good, but trivial": css(light(GOOD)),
    "one-sided": css(ONE_SIDED),
    "poor": css(BAD),
    "none of these": css(MUTED),
    FAILED: css(FAINT),
}
MARKERS = dict(zip(COLORS, ("o", "D", "s", "v", "P", "X"), strict=True))
"""Shapes of markers, so that kinds differ in more than color."""
MAX_PANELS = 6
LOG_FROM = 3.0
"""Ratio of the greatest to the least value from which the axis is logarithmic."""
UNIFORM = float(np.log(len(SHOWN_MOVES.names)))
"""Entropy of the uniform distribution over the chapter's three moves, nats."""
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

    @property
    def rows(self) -> list[Row]:
        """Runs with progress in all panels, which share their axes."""
        groups = (group for panel in self.panels.values() for group in panel)
        return [row for group in groups for row in group.with_progress]


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


def draw(layout: Layout, name: str) -> tuple[bytes, bytes]:
    """Return one of `PLOTS` for a light and for a dark page."""
    _, plot, height = PLOTS[name]
    pages = []
    for sheet in ("default", "dark_background"):
        with style.context(sheet):
            pages.append(_render(layout, [plot], height, transparent=True))
    return pages[0], pages[1]


def draw_outcome(layout: Layout) -> bytes:
    """Return verdicts, sides and entropies as one image for a light page."""
    return _render(layout, [_verdicts, _sides, _entropies], height=2.5)


def _render(
    layout: Layout, plots: Sequence["Plot"], height: float, transparent: bool = False
) -> bytes:
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
    figure.savefig(file, format="png", dpi=110, transparent=transparent)
    return file.getvalue()


def _curves(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    colors = colormaps["viridis"](np.linspace(0.1, 0.9, max(1, len(groups))))
    for group, color in zip(groups, colors, strict=True):
        end = max((row.frames for row in group.with_progress), default=0.0)
        if end == 0.0:
            continue
        grid = np.linspace(0, end, 120)
        values = np.stack([on_grid(*row.curve, grid) for row in group.with_progress])
        label = _literal(group.settings.get(layout.axis or "", "all runs"))
        band = median_band(values)
        if band is None:
            labels = [label, *["_"] * (len(values) - 1)]  # legends omit a leading underscore
            axes.plot(grid, values.T, color=color, linewidth=0.8, label=labels)
        else:
            axes.plot(grid, np.median(values, axis=0), color=color, label=label)
            axes.fill_between(grid, *band, color=color, alpha=0.2, linewidth=0)
    every = [group for panel in layout.panels.values() for group in panel]  # they share the axis
    least = min(
        (row.curve[1].min(initial=0.0) for g in every for row in g.with_progress), default=0.0
    )
    axes.set(xlabel="frames", ylabel="running reward / largest reward", ylim=(1.05 * least, 1))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(title=_literal(layout.axis or ""), fontsize=7, title_fontsize=7)


def _verdicts(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    places = _places(axes, layout, groups)
    for i, kind in enumerate(COLORS):
        shares = [group.verdicts[kind] for group in groups]
        ended = [(x, s) for x, s in zip(places, shares, strict=True) if s.trials]
        if not any(s.successes for _, s in ended):
            continue
        x = _aside(axes, np.array([place for place, _ in ended]), 0.08 * (i - 2), places)
        y, low, high = np.array([(s.share, s.lower95, s.upper95) for _, s in ended]).T
        error = np.abs([y - low, high - y])
        axes.errorbar(x, y, yerr=error, markersize=4, capsize=2, **_style(kind))
    axes.set(ylabel="fraction of runs", ylim=(-0.03, 1.03))
    _explain_colors(axes)


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
    places = _places(axes, layout, groups)
    for place, group in zip(places, groups, strict=True):
        judged = [(value(row), row) for row in group.finished if row.kind in KINDS]
        dots = [(y, row) for y, row in judged if y is not None]
        for i, (y, row) in enumerate(sorted(dots, key=lambda dot: KINDS.index(dot[1].kind))):
            shift = min(0.05, 0.6 / len(dots)) * (i - (len(dots) - 1) / 2)
            x = _aside(axes, np.array([place]), shift, places)
            fill = "full" if row.certain else "none"
            axes.plot(x, [y], ls="", markersize=4, fillstyle=fill, **_style(str(row.kind)))
    _explain_colors(axes)


def _aside(axes: Axes, places: NDArray, shift: float, every: Sequence[float]) -> NDArray:
    """Shift positions by a fraction of the least distance between two of them."""
    is_log = axes.get_xscale() == "log"
    at = np.unique(np.log(every) if is_log else every)
    step = float(np.diff(at).min()) if len(at) > 1 else (np.log(3.0) if is_log else 1.0)
    return places * np.exp(shift * step) if is_log else places + shift * step


def _style(kind: str) -> dict[str, Any]:
    return {"marker": MARKERS[kind], "color": COLORS[kind]}


def _explain_colors(axes: Axes) -> None:
    """Add one legend above the image."""
    figure = axes.get_figure(root=True)
    if figure is None or figure.legends:
        return
    handles = [Line2D([], [], label=kind, **_style(kind)) for kind in COLORS]
    columns = min(len(handles), max(1, int(figure.get_figwidth() / _LEGEND_ENTRY_INCHES)))
    figure.legend(handles=handles, loc="outside upper center", ncols=columns, fontsize=8)


def _costs(axes: Axes, layout: Layout, groups: list[RunGroup]) -> None:
    for place, group in zip(_places(axes, layout, groups), groups, strict=True):
        for row in group.with_progress:
            kind = "poor" if row.state == FAILED else "none of these"
            color = COLORS["good" if row.is_solved else kind]
            marker, fill = ("o", "full") if row.is_solved else ("^", "none")
            axes.plot([place], [row.frames], marker, alpha=0.6, color=color, fillstyle=fill)
    top = max((row.frames for row in layout.rows), default=0) or 1
    axes.set(ylabel="frames to solve", ylim=(0, 1.2 * top))


Plot = Callable[[Axes, Layout, list[RunGroup]], None]
PLOTS: dict[str, tuple[str, Plot, float]] = {
    "curves": ("Learning curves", _curves, 3.6),
    "shares": ("Verdicts", _verdicts, 3.4),
    "sides": ("Left and right", _sides, 3.2),
    "entropies": ("Entropy at the end", _entropies, 3.2),
    "costs": ("Frames to solve", _costs, 3.2),
}
"""Title, function and height in inches of each plot, by the prefix of its `SENTENCES`."""


def _places(axes: Axes, layout: Layout, groups: list[RunGroup]) -> list[float]:
    """Set the ticks and return the x position of each group: its number, or its index."""
    names = [str(group.settings.get(layout.axis or "", "")) for group in groups]
    axes.set_xlabel(_literal(layout.axis or "all runs"))
    try:
        places = [float(name) for name in names]
    except ValueError:
        axes.set_xticks(range(len(names)), [_literal(n) for n in names], rotation=20, fontsize=7)
        return [float(i) for i in range(len(names))]
    if min(places) > 0 and max(places) / min(places) >= LOG_FROM:
        axes.set_xscale("log")
    axes.set_xticks(places, names, rotation=20, fontsize=7)
    axes.set_xticks([], minor=True)
    axes.update_datalim([(place, 0.0) for place in places])
    axes.autoscale_view()
    return places


def _literal(text: str) -> str:
    """Escape dollar signs, which matplotlib reads as formulas."""
    return text.replace("$", r"\$")
