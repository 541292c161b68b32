"""Maps of the action by the position of a cube, as a chart and as SVG."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from drone_rl.sim.vocabulary import ShownActions
from drone_rl.utils.palette import FAINT, INK, MUTED, css

_LINE = 'fill="none" class="line"'
_CLOSEST = "two highest logits closest"


def chart(numbers: Mapping[str, Any], arrays: Mapping[str, NDArray], names: ShownActions) -> Figure:
    """Draw the map as a chart.

    `numbers` are "places" of an explanation; `arrays` are those of `ActionMap.outlines`.
    """
    window = numbers["window"]
    side, near, far = window["sideways"], window["nearest"], window["farthest"]
    width = 9.0
    figure = Figure(figsize=(width, 1.6 + 0.88 * width * far / (2 * side)), layout="constrained")
    axis = figure.subplots()
    for label, outlines in _by_label(arrays).items():
        closed = [np.concatenate([line, line[:1]])[:, ::-1] for line in outlines]
        path = Path.make_compound_path(*(Path(line, closed=True) for line in closed))
        is_action = label < len(names.names)
        style: dict[str, Any] = (
            {"facecolor": names.css(label), "alpha": 0.85}
            if is_action
            else {"fill": False, "hatch": "////", "edgecolor": "#ffffff"}
        )
        axis.add_patch(PathPatch(path, linewidth=0, **style))
    _mark(axis, numbers)
    axis.set(xlim=(side, -side), ylim=(-0.04 * far, far), aspect="equal")
    axis.set_xlabel("metres to the left (+) or right (-)")
    axis.set_ylabel("metres ahead of the camera")
    axis.axhline(near, color=css(INK), lw=0.5)
    note = f"not covered: closer than {near:g} m"
    axis.text(0.97 * side, 0.5 * near, note, va="center", color=css(FAINT))
    axis.set_title("Action for one cube at each position")
    handles = [Patch(color=names.css(a), label=f"goes {names.names[a]}") for a in names.order]
    if numbers["unseen"]:
        style = {"facecolor": css(MUTED), "edgecolor": "white", "hatch": "////"}
        handles.append(Patch(**style, label="cube not seen"))
    handles += axis.get_legend_handles_labels()[0]
    axis.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3, frameon=False
    )
    return figure


def _mark(axis: Axes, numbers: Mapping[str, Any]) -> None:
    """Mark the camera, the limits of flying straight on, and the smallest difference of logits."""
    touch = numbers["touch_distance"]
    for y in (-touch, touch):
        label = "beyond: flying straight on misses it" if y < 0 else None
        axis.axvline(y, color="white", ls=(0, (5, 4)), lw=1.6)
        axis.axvline(y, color=css(INK), ls=(0, (5, 4)), lw=0.8, label=label)
    axis.plot(0, 0, "^", color=css(INK), ms=11, clip_on=False, ls="", label="camera, facing up")
    at = numbers["least_gap_left"], numbers["least_gap_ahead"]
    for color, width, label in (
        ("white", 2, None),
        (css(INK), 1, _CLOSEST),
    ):
        axis.plot(*at, "o", ms=11, mfc="none", mew=width, color=color, ls="", label=label)


def svg(numbers: Mapping[str, Any], arrays: Mapping[str, NDArray], names: ShownActions) -> str:
    """Draw the map as an SVG element; arguments as for `chart`."""
    window, touch = numbers["window"], numbers["touch_distance"]
    side, near, far = window["sideways"], window["nearest"], window["farthest"]
    unit = (side + far) / 60
    left, below = side + 3 * unit, 4.5 * unit
    box = (-left, -far - unit, left + side + unit, far + unit + below)
    parts = [
        f'<svg class="places" viewBox="{" ".join(f"{v:g}" for v in box)}" role="img" '
        'aria-label="Action for one cube at each position" font-family="sans-serif" '
        f'font-size="{unit:g}">',
        '<defs><pattern id="unseen" width=".3" height=".3" patternUnits="userSpaceOnUse" '
        'patternTransform="rotate(45)"><rect width=".1" height=".3" fill="#fff" '
        'fill-opacity=".7"/></pattern></defs>',
    ]
    for label, outlines in _by_label(arrays).items():
        fill, style, inner = "url(#unseen)", ' pointer-events="none"', ""
        if label < len(names.names):
            fill, style = names.css(label), ""
            inner = f"<title>{escape(f'goes {names.names[label]}')}</title>"
        parts.append(
            f'<path fill="{fill}" fill-opacity=".85" fill-rule="evenodd"{style} '
            f'd="{"".join(map(_path_data, outlines))}">{inner}</path>'
        )
    parts += [
        f'<path {_LINE} stroke="#fff" stroke-width=".05" stroke-dasharray=".3 .2" '
        f'd="M{x:g} {-near:g}V{-far:g}"/>'
        for x in (-touch, touch)
    ]
    parts += [*_scale(side, near, far, unit), *_marks(numbers, unit), *_key(names, side, unit)]
    return "\n".join([*parts, "</svg>"])


def _scale(side: float, near: float, far: float, unit: float) -> list[str]:
    """Frame and tick labels."""
    frame = f"M{-side:g} {-near:g}H{side:g}V{-far:g}H{-side:g}Z"
    ahead = [y for y in _ticks(far) if y >= near]
    aside = [x for x in _ticks(side) if x]
    text, low = 'fill="currentColor" text-anchor', 1.2 * unit - near
    return [
        f'<path {_LINE} stroke="currentColor" stroke-width=".03" d="{frame}"/>',
        *(f'<text {text}="end" x="{-side - unit / 3:g}" y="{unit / 3 - y:g}">{y:g} m</text>'
          for y in ahead),
        *(f'<text {text}="middle" x="{sign * x:g}" y="{low:g}">{x:g} m</text>'
          for x in aside for sign in (-1, 1)),
    ]  # fmt: skip


def _marks(numbers: Mapping[str, Any], unit: float) -> list[str]:
    """Mark the camera and the smallest difference of logits."""
    x, y = -numbers["least_gap_left"], -numbers["least_gap_ahead"]
    circle = f'<circle cx="{x:.6g}" cy="{y:.6g}" r="{unit / 2:g}" {_LINE}'
    camera = f"M0 {-unit:g}L{0.7 * unit:g} {0.6 * unit:g}H{-0.7 * unit:g}Z"
    return [
        f'<path fill="currentColor" d="{camera}"><title>camera</title></path>',
        f'{circle} stroke="#fff" stroke-width=".12"/>',
        f'{circle} stroke="#000" stroke-width=".05"><title>{_CLOSEST}</title></circle>',
    ]


def _key(names: ShownActions, side: float, unit: float) -> list[str]:
    """Legend."""
    parts, step = [], 2 * side / len(names.names)
    for place, action in enumerate(names.order):
        x, y = place * step - side, 2.2 * unit
        parts += [
            f'<rect x="{x:g}" y="{y:g}" width="{unit:g}" height="{unit:g}" '
            f'fill="{names.css(action)}"/>',
            f'<text fill="currentColor" x="{x + 1.4 * unit:g}" y="{y + 0.9 * unit:g}">goes '
            f"{escape(names.names[action])}</text>",
        ]
    return parts


def _ticks(most: float) -> list[float]:
    """About four round numbers from 0 up."""
    size = 10.0 ** np.floor(np.log10(most / 5))
    step = next((size * k for k in (1, 2, 5) if most / (size * k) <= 5), size * 10)
    return (step * np.arange(int(most / step + 1e-9) + 1)).tolist()


def _by_label(arrays: Mapping[str, NDArray]) -> dict[int, list[NDArray]]:
    """Outlines by label."""
    outlines: dict[int, list[NDArray]] = {}
    parts = np.split(arrays["points"], arrays["ends"][:-1])
    for label, outline in zip(arrays["labels"].tolist(), parts, strict=True):
        outlines.setdefault(label, []).append(outline)
    return dict(sorted(outlines.items()))


def _path_data(outline: NDArray) -> str:
    """An outline as SVG path data, to a tenth of a millimetre."""
    whole = np.round(-1e4 * outline[:, ::-1]).astype(int)
    steps: Sequence[Any] = np.diff(whole, axis=0).tolist()
    begin = f"M{_short(whole[0, 0])} {_short(whole[0, 1])}"
    return begin + "l" + " ".join(f"{_short(x)} {_short(y)}" for x, y in steps) + "z"


def _short(value: int) -> str:
    """Ten-thousandths as a decimal number."""
    return f"{value / 1e4:.4f}".rstrip("0").rstrip(".")
