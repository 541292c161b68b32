"""Report section "places": the exact map of the action over one cube's place."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from drone_rl.explanations.report.part import Figures, Part
from drone_rl.explanations.results import ExactMap, Explanation, Outlines
from drone_rl.sim.vocabulary import ShownActions
from drone_rl.utils.palette import FAINT, INK, MUTED, css
from drone_rl.utils.text import percent, render

WHERE = {"left": "on its left", "ahead": "straight ahead", "right": "on its right"}


def rows(places: ExactMap, names: Sequence[str]) -> list[list[str]]:
    """Return a map as rows of a table, one for each side, the header first."""
    head = ["one cube", "share of places", *names, "not seen", "no reaction"]
    by_side = {**{WHERE[side]: of for side, of in places.sides.items()}, "anywhere": places}
    shares = {w: (of.share, *of.actions, of.unseen, of.blind) for w, of in by_side.items()}
    return [head, *([where, *(percent(s, 2) for s in of)] for where, of in shares.items())]


def describe(places: ExactMap, names: Sequence[str]) -> str:
    """Return what the exact map shows in words."""
    return render("drone_rl.explanations.report", "places.j2", map=places, names=names, where=WHERE)


def draw(places: ExactMap, explanation: Explanation) -> Figures:
    """Draw the exact map."""
    return {"places": chart(places, explanation.actions)}


def values(places: ExactMap, explanation: Explanation) -> dict[str, Any]:
    """Return the map in words, and as a table."""
    names = explanation.actions.names
    return {"text": describe(places, names), "rows": rows(places, names)}


def chart(places: ExactMap, actions: ShownActions) -> Figure:
    """Draw the map as a chart."""
    window = places.window
    side, near, far = window.sideways, window.nearest, window.farthest
    width = 6.0  # inches, legible on a phone
    figure = Figure(figsize=(width, 1.6 + 0.88 * width * far / (2 * side)), layout="constrained")
    axis = figure.subplots()
    for label, outlines in _by_label(places.outlines).items():
        closed = [np.concatenate([line, line[:1]])[:, ::-1] for line in outlines]
        path = Path.make_compound_path(*(Path(line, closed=True) for line in closed))
        is_action = label < len(actions.names)
        style: dict[str, Any] = (
            {"facecolor": actions.css(label), "alpha": 0.85}
            if is_action
            else {"fill": False, "hatch": "////", "edgecolor": "#ffffff"}
        )
        axis.add_patch(PathPatch(path, linewidth=0, **style))
    _mark(axis, places)
    axis.set(xlim=(side, -side), ylim=(-0.04 * far, far), aspect="equal")
    axis.set_xlabel("metres to the left (+) or right (-)")
    axis.set_ylabel("metres ahead of the camera")
    axis.axhline(near, color=css(INK), lw=0.5)
    note = f"not covered: closer than {near:g} m"
    axis.text(0.97 * side, 0.5 * near, note, va="center", color=css(FAINT), backgroundcolor="white")
    axis.set_title("Action for one cube at each position")
    handles = [Patch(color=actions.css(a), label=f"goes {actions.names[a]}") for a in actions.order]
    if places.unseen:
        style = {"facecolor": css(MUTED), "edgecolor": "white", "hatch": "////"}
        handles.append(Patch(**style, label="cube not seen"))
    handles += axis.get_legend_handles_labels()[0]
    axis.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=2, frameon=False
    )
    return figure


def _mark(axis: Axes, places: ExactMap) -> None:
    """Mark the camera, the limits of flying straight on, and the smallest difference of logits."""
    touch = places.touch_distance
    for y in (-touch, touch):
        label = "beyond: flying straight on misses it" if y < 0 else None
        axis.axvline(y, color="white", ls=(0, (5, 4)), lw=1.6)
        axis.axvline(y, color=css(INK), ls=(0, (5, 4)), lw=0.8, label=label)
    axis.plot(0, 0, "^", color=css(INK), ms=11, clip_on=False, ls="", label="camera, facing up")
    at = places.least_gap_left, places.least_gap_ahead
    for color, width, label in (("white", 2, None), (css(INK), 1, "two highest logits closest")):
        axis.plot(*at, "o", ms=11, mfc="none", mew=width, color=color, ls="", label=label)


def _by_label(of: Outlines) -> dict[int, list[NDArray]]:
    """Outlines by label."""
    outlines: dict[int, list[NDArray]] = {}
    parts = np.split(of.points, of.ends[:-1])
    for label, outline in zip(of.labels.tolist(), parts, strict=True):
        outlines.setdefault(label, []).append(outline)
    return dict(sorted(outlines.items()))


PART = Part(title="Exact action map of one cube", label="Exact map", draw=draw, values=values)
