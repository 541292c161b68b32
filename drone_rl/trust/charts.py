"""Charts of a robustness evaluation: curves of success rates, and strips of camera images."""

from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from drone_rl.config.commands import MODES
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.plots.images import enlarge, gridded, stacked, titled
from drone_rl.trust.plots.saving import new_chart
from drone_rl.trust.shifts_results import ModeFigures, Robustness, number
from drone_rl.utils.palette import BAD, FAINT, GOOD, INK, MUTED, PAPER, css
from drone_rl.utils.text import percent

_COLUMNS = 4
_LEAST_GAP = 0.06
"""From the label of no perturbation to others, as a fraction of an axis's length."""
_POLICY, _ORACLE, _GOOD = css(INK), css(MUTED), css(GOOD)
_OTHERS = {
    "drifting": (css(FAINT), "--", "... if the perturbation drifts"),
    "onset": (css(FAINT), ":", "... if perturbed from step 20 on"),
}
_SCALE = 3
_TILES, _GAP, _HEADING = 3, 8, 28
"""Images in a row of a strip, pixels between them, and height of its heading."""


def chart(shifts: Robustness) -> Figure:
    """Plot success rate over strength by axis, with 95% intervals, the oracle and the range."""
    axes = shifts.axes
    columns = min(len(axes) + 1, _COLUMNS)
    rows = -(-(len(axes) + 1) // columns)
    figure = Figure(figsize=(4.2 * columns, 2.9 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, name in zip(grid, axes, strict=False):
        _curve(axis, name, shifts)
    for axis in grid[len(axes) :]:
        axis.axis("off")
    _add_legend(grid[len(axes)], grid[: len(axes)])
    return figure


def curves(shifts: Robustness) -> dict[str, Figure]:
    """Return a chart of one panel for each axis, by its label, and their legend; see `chart`."""
    charts = {NAMES[name]: new_chart(height=2.9) for name in shifts.axes}
    for (_, axis), name in zip(charts.values(), shifts.axes, strict=True):
        _curve(axis, name, shifts)
    figure, axis = new_chart(height=2.9)
    axis.axis("off")
    _add_legend(axis, [panel for _, panel in charts.values()])
    return {**{name: chart for name, (chart, _) in charts.items()}, "legend": figure}


def _add_legend(axis: Axes, panels: Iterable[Axes]) -> None:
    """Add one legend of several panels."""
    handles: dict[str, Any] = {}
    for panel in panels:
        handles |= dict(zip(*reversed(panel.get_legend_handles_labels()), strict=True))
    axis.legend(handles.values(), handles.keys(), loc="center", frameon=False)


def _curve(axis: Axes, name: str, shifts: Robustness) -> None:
    along, plain = shifts.axes[name], shifts.plain
    levels = along.allowed
    ticks = [(0.0, along.neutral), *((level.position, level.value) for level in levels)]
    for mode in MODES:
        points: list[tuple[float, ModeFigures]] = [(0.0, plain)]
        points += [(v.position, v.modes[mode]) for v in levels if mode in v.modes]
        if len(points) > 1:
            _line(axis, sorted(points, key=lambda point: point[0]), mode)
    oracles = [(0.0, plain.oracle), *((v.position, v.oracle) for v in levels)]
    if plain.oracle is not None:
        where, shares = zip(*sorted((x, o.share) for x, o in oracles if o), strict=True)
        label = "oracle"
        axis.plot(where, shares, color=_ORACLE, lw=1, label=label, zorder=1)
    for level in levels:
        if level.impossible:
            axis.plot(level.position, 0.03, "x", color=css(BAD), label="impossible", ls="")
    if name in shifts.ranges and (ends := shifts.ranges[name].positions) is not None:
        low, high = ends
        axis.axvspan(low, high, color=_GOOD, alpha=0.13, lw=0, label="certainly good in this range")
    least = _LEAST_GAP * (max(ticks)[0] - min(ticks)[0])
    ticks = sorted(tick for tick in ticks if not 0.0 < abs(tick[0]) < least)
    axis.set_xticks([x for x, _ in ticks], [number(value) for _, value in ticks], fontsize=8)
    axis.set(ylim=(-0.03, 1.05), yticks=[0, 0.5, 1], yticklabels=["0%", "50%", "100%"])
    axis.set_title(NAMES[name], fontsize=11)
    axis.set_xlabel(along.unit, fontsize=9)
    axis.axvline(0.0, color=css(MUTED), lw=0.8, ls=":", label="unperturbed", zorder=0)
    axis.spines[["top", "right"]].set_visible(False)


def _line(axis: Axes, points: Sequence[tuple[float, ModeFigures]], mode: str) -> None:
    where = [x for x, _ in points]
    success = [figures.success for _, figures in points]
    shares = [s.share or 0.0 for s in success]
    if mode in _OTHERS:
        color, style, label = _OTHERS[mode]
        axis.plot(where, shares, style, color=color, lw=1.3, label=label)
        return
    low, high = [s.lower95 for s in success], [s.upper95 for s in success]
    axis.fill_between(where, low, high, color=_POLICY, alpha=0.2, lw=0, label="95% interval")
    axis.plot(where, shares, "o-", color=_POLICY, ms=3.5, label="success rate of the policy")


def strips(shifts: Robustness) -> Image.Image:
    """Arrange camera images at each strength with success rates, one axis below the other."""
    return stacked([_strip(shifts, name) for name in shifts.pictures], gap=0)


def conditions(
    shifts: Robustness, name: str, frames: Sequence[NDArray | None]
) -> dict[str, Image.Image]:
    """Return camera images of one axis by caption, which has the strength and the success rate.

    `frames` are as from `Robustness.frames`.
    """
    images: dict[str, Image.Image] = {}
    if frames[0] is not None:
        images[f"unperturbed: {_success(shifts.plain)}"] = enlarge(frames[0], _SCALE)
    for level in shifts.axes[name].allowed:
        if (frame := frames[level.number]) is not None:
            caption = f"{number(level.value)}: {_success(level.constant)}"
            images[caption] = enlarge(frame, _SCALE)
    return images


def _success(figures: ModeFigures) -> str:
    return f"{percent(figures.success.share or 0.0)} succeed"


def _strip(shifts: Robustness, name: str) -> Image.Image:
    images = conditions(shifts, name, shifts.frames(name))
    tiles = [titled(image, text) for text, image in images.items()]
    grid = gridded(tiles, _TILES, gap=_GAP)
    canvas = Image.new("RGB", (_TILES * (tiles[0].width + _GAP), grid.height + _HEADING + 6), PAPER)
    canvas.paste(grid, (0, _HEADING))
    along = shifts.axes[name]
    heading = f"{NAMES[name]} ({along.unit}; {number(along.neutral)} unperturbed)"
    ImageDraw.Draw(canvas).text((2, 4), heading, INK, ImageFont.load_default(16))
    return canvas
