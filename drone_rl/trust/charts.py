"""Charts of a robustness evaluation: curves of success rates, and strips of camera images."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from drone_rl.trust.plots.images import enlarge, gridded, stacked, titled
from drone_rl.trust.plots.saving import new_chart
from drone_rl.trust.shifts_text import NAMES
from drone_rl.utils.palette import BAD, FAINT, GOOD, INK, MUTED, PAPER, css
from drone_rl.utils.text import percent

_COLUMNS = 4
_POLICY, _ORACLE, _GOOD = css(INK), css(MUTED), css(GOOD)
_OTHERS = {
    "drifting": (css(FAINT), "--", "drifting"),
    "onset": (css(FAINT), ":", "from step 20 on"),
}
_SCALE = 3
_TILES, _GAP, _HEADING = 3, 8, 28
"""Images in a row of a strip, pixels between them, and height of its heading."""


def chart(numbers: Mapping[str, Any]) -> Figure:
    """Plot success rate over strength by axis, with 95% intervals, the oracle and the range.

    `numbers` are those of `shifts.json`.
    """
    axes = numbers["axes"]
    rows = -(-(len(axes) + 1) // _COLUMNS)
    figure = Figure(figsize=(4.2 * _COLUMNS, 2.9 * rows), layout="constrained")
    grid = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    ranges = (numbers["domain"] or {}).get("ranges", {})
    for axis, (name, along) in zip(grid, axes.items(), strict=False):
        _curve(axis, name, along, numbers["plain"], ranges.get(name))
    for axis in grid[len(axes) :]:
        axis.axis("off")
    _add_legend(grid[len(axes)], grid[: len(axes)])
    return figure


def curves(numbers: Mapping[str, Any]) -> dict[str, Figure]:
    """Return a chart of one panel for each axis, by its label, and their legend; see `chart`."""
    ranges = (numbers["domain"] or {}).get("ranges", {})
    charts = {NAMES[name]: new_chart(height=2.9) for name in numbers["axes"]}
    for (_, axis), (name, along) in zip(charts.values(), numbers["axes"].items(), strict=True):
        _curve(axis, name, along, numbers["plain"], ranges.get(name))
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


def _curve(
    axis: Axes,
    name: str,
    along: Mapping[str, Any],
    plain: Mapping[str, Any],
    range_: Mapping[str, Any] | None,
) -> None:
    levels = [level for level in along["levels"] if level["refused"] is None]
    ticks = [(0.0, along["neutral"]), *((v["position"], v["value"]) for v in levels)]
    for mode in ("constant", *_OTHERS):
        points = [(0.0, plain)] + [
            (v["position"], v["modes"][mode]) for v in levels if mode in v["modes"]
        ]
        if len(points) > 1:
            _line(axis, sorted(points, key=lambda point: point[0]), mode)
    oracles = [(0.0, plain["oracle"]), *((v["position"], v["oracle"]) for v in levels)]
    if plain["oracle"] is not None:
        where, shares = zip(*sorted((x, o["share"]) for x, o in oracles), strict=True)
        label = "oracle"
        axis.plot(where, shares, color=_ORACLE, lw=1, label=label, zorder=1)
    for level in levels:
        if level["impossible"]:
            axis.plot(level["position"], 0.03, "x", color=css(BAD), label="impossible", ls="")
    if range_ is not None and range_["positions"] is not None:
        low, high = range_["positions"]
        axis.axvspan(low, high, color=_GOOD, alpha=0.13, lw=0, label="certainly good in this range")
    ticks.sort(key=lambda tick: tick[0])
    axis.set_xticks([x for x, _ in ticks], [_value(value) for _, value in ticks], fontsize=8)
    axis.set(ylim=(-0.03, 1.05), yticks=[0, 0.5, 1], yticklabels=["0%", "50%", "100%"])
    axis.set_title(NAMES[name], fontsize=11)
    axis.set_xlabel(along["unit"], fontsize=9)
    axis.axvline(0.0, color=css(MUTED), lw=0.8, ls=":", label="unperturbed", zorder=0)
    axis.spines[["top", "right"]].set_visible(False)


def _line(axis: Axes, points: Sequence[tuple[float, Mapping[str, Any]]], mode: str) -> None:
    where = [x for x, _ in points]
    success = [figures["success"] for _, figures in points]
    shares = [s["share"] for s in success]
    if mode in _OTHERS:
        color, style, label = _OTHERS[mode]
        axis.plot(where, shares, style, color=color, lw=1.3, label=label)
        return
    low, high = ([s[k] for s in success] for k in ("lower95", "upper95"))
    axis.fill_between(where, low, high, color=_POLICY, alpha=0.2, lw=0, label="95% interval")
    axis.plot(where, shares, "o-", color=_POLICY, ms=3.5, label="success rate of the policy")


def _value(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g}"


def strips(
    numbers: Mapping[str, Any], pictures: Mapping[str, Sequence[NDArray | None]]
) -> Image.Image:
    """Arrange camera images at each strength with success rates, one axis below the other.

    `numbers` are those of `shifts.json`; `pictures` are by axis, without perturbation and at each
    strength. Shapes: (H, W, 3).
    """
    rows = [_strip(numbers, name, shown) for name, shown in pictures.items()]
    return stacked(rows, gap=0)


def conditions(
    numbers: Mapping[str, Any], name: str, pictures: Sequence[NDArray | None]
) -> dict[str, Image.Image]:
    """Return camera images of one axis by caption, which has the strength and the success rate."""
    shown: dict[str, Image.Image] = {}
    if pictures[0] is not None:
        shown[f"unperturbed: {_success(numbers['plain'])}"] = enlarge(pictures[0], _SCALE)
    for level in numbers["axes"][name]["levels"]:
        picture = pictures[level["number"]]
        if picture is not None and level["refused"] is None:
            caption = f"{level['value']:.3g}: {_success(level['modes']['constant'])}"
            shown[caption] = enlarge(picture, _SCALE)
    return shown


def _success(result: Mapping[str, Any]) -> str:
    return f"{percent(result['success']['share'])} succeed"


def _strip(
    numbers: Mapping[str, Any], name: str, pictures: Sequence[NDArray | None]
) -> Image.Image:
    tiles = [titled(picture, text) for text, picture in conditions(numbers, name, pictures).items()]
    grid = gridded(tiles, _TILES, gap=_GAP)
    canvas = Image.new("RGB", (_TILES * (tiles[0].width + _GAP), grid.height + _HEADING + 6), PAPER)
    canvas.paste(grid, (0, _HEADING))
    along = numbers["axes"][name]
    heading = f"{NAMES[name]} ({along['unit']}; {_value(along['neutral'])} unperturbed)"
    ImageDraw.Draw(canvas).text((2, 4), heading, INK, ImageFont.load_default(16))
    return canvas
