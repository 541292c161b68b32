"""Charts of a robustness evaluation: curves of success rates, and strips of camera images."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from drone_rl.evaluation.plots.images import (
    BACKGROUND,
    INK,
    MUTED,
    enlarge,
    gridded,
    stacked,
    titled,
)
from drone_rl.robustness.shifts_text import NAMES
from drone_rl.utils.text import percent

_COLUMNS = 4
_POLICY, _ORACLE, _GOOD = "#1f60c8", "#2ca02c", "#2ca02c"
_OTHERS = {"drifting": ("#e07b00", "--", "drifting"), "onset": ("#8a4fbf", ":", "from step 20 on")}
_SCALE = 3
_LABEL = 190
"""Width of the names next to strips, pixels."""


def chart(numbers: Mapping[str, Any]) -> Figure:
    """Plot success rate over strength by axis, with 95% intervals, the oracle and the range.

    `numbers` are those of `shifts.json`.
    """
    axes = numbers["axes"]
    rows = -(-(len(axes) + 1) // _COLUMNS)
    figure = Figure(figsize=(4.2 * _COLUMNS, 2.9 * rows), layout="constrained")
    places = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    ranges = (numbers["domain"] or {}).get("ranges", {})
    for place, (name, along) in zip(places, axes.items(), strict=False):
        _curve(place, name, along, numbers["plain"], ranges.get(name))
    for place in places[len(axes) :]:
        place.axis("off")
    handles = {}
    for place in places[: len(axes)]:
        handles |= dict(zip(*reversed(place.get_legend_handles_labels()), strict=True))
    places[len(axes)].legend(handles.values(), handles.keys(), loc="center", frameon=False)
    return figure


def _curve(
    place: Axes,
    name: str,
    along: Mapping[str, Any],
    plain: Mapping[str, Any],
    found: Mapping[str, Any] | None,
) -> None:
    levels = [level for level in along["levels"] if level["refused"] is None]
    ticks = [(0.0, along["neutral"]), *((v["position"], v["value"]) for v in levels)]
    for mode in ("constant", *_OTHERS):
        points = [(0.0, plain)] + [
            (v["position"], v["modes"][mode]) for v in levels if mode in v["modes"]
        ]
        if len(points) > 1:
            _line(place, sorted(points, key=lambda point: point[0]), mode)
    known = [(0.0, plain["oracle"]), *((v["position"], v["oracle"]) for v in levels)]
    if plain["oracle"] is not None:
        where, shares = zip(*sorted((x, o["share"]) for x, o in known), strict=True)
        label = "oracle"
        place.plot(where, shares, color=_ORACLE, lw=1, label=label, zorder=1)
    for level in levels:
        if level["impossible"]:
            place.plot(level["position"], 0.03, "x", color="#d62728", label="impossible", ls="")
    if found is not None and found["positions"] is not None:
        low, high = found["positions"]
        place.axvspan(
            low, high, color=_GOOD, alpha=0.13, lw=0, label="certainly good in this range"
        )
    ticks.sort(key=lambda tick: tick[0])
    place.set_xticks([x for x, _ in ticks], [_value(value) for _, value in ticks], fontsize=8)
    place.set(ylim=(-0.03, 1.05), yticks=[0, 0.5, 1], yticklabels=["0%", "50%", "100%"])
    place.set_title(NAMES[name], fontsize=11)
    place.set_xlabel(along["unit"], fontsize=9)
    place.axvline(0.0, color="#b4b8c0", lw=0.8, ls=":", label="as it was trained", zorder=0)
    place.spines[["top", "right"]].set_visible(False)


def _line(place: Axes, points: Sequence[tuple[float, Mapping[str, Any]]], mode: str) -> None:
    where = [x for x, _ in points]
    success = [figures["success"] for _, figures in points]
    shares = [s["share"] for s in success]
    if mode in _OTHERS:
        color, style, label = _OTHERS[mode]
        place.plot(where, shares, style, color=color, lw=1.3, label=label)
        return
    low, high = ([s[k] for s in success] for k in ("lower95", "upper95"))
    place.fill_between(where, low, high, color=_POLICY, alpha=0.2, lw=0, label="95% interval")
    place.plot(where, shares, "o-", color=_POLICY, ms=3.5, label="success rate of the policy")


def _value(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g}"


def strips(
    numbers: Mapping[str, Any], pictures: Mapping[str, Sequence[NDArray | None]]
) -> Image.Image:
    """Arrange camera images at each strength, one row per axis, with success rates.

    `numbers` are those of `shifts.json`; `pictures` are by axis, without perturbation and at each
    strength. Shapes: (H, W, 3).
    """
    rows = [_strip(name, numbers["axes"][name], shown) for name, shown in pictures.items()]
    return stacked(rows, gap=0)


def _strip(name: str, along: Mapping[str, Any], pictures: Sequence[NDArray | None]) -> Image.Image:
    by_number = {level["number"]: level for level in along["levels"]}
    first = pictures[0]
    assert first is not None
    cells = [titled(enlarge(first, _SCALE), "as it was trained")]
    for number, picture in enumerate(pictures[1:], 1):
        if picture is not None and number in by_number:
            level = by_number[number]
            success = percent(level["modes"]["constant"]["success"]["share"])
            caption = f"{level['value']:.3g}: success rate {success}"
            cells.append(titled(enlarge(picture, _SCALE), caption))
    strip = gridded(cells, len(cells), gap=8)
    height = strip.height
    canvas = Image.new("RGB", (_LABEL + 6 * (cells[0].width + 8), height + 6), BACKGROUND)
    canvas.paste(strip, (_LABEL, 0))
    pen = ImageDraw.Draw(canvas)
    pen.multiline_text((4, height // 2 - 16), NAMES[name], INK, ImageFont.load_default(15))
    pen.text((4, height // 2 + 6), along["unit"], MUTED, ImageFont.load_default(13))
    return canvas
