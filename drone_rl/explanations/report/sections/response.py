"""What it does about one target, wherever that stands."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from drone_rl.evaluation.plots.saving import Rows
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.response_text import RESPONSE
from drone_rl.sim.vocabulary import ShownActions

_OUTCOMES = ("#d9d9de", "#4269d0")
"""Colours of what is not handled, and of what is."""


def response_chart(explanation: Explanation) -> Figure:
    """Probability of each action by where the target stands, the chosen action, what comes of it.

    A row for each height at which targets stand, the highest on top.
    """
    arrays = explanation.arrays
    heights = arrays["response_height"]
    actions, count = explanation.actions, len(explanation.actions.names)
    terms = explanation.terms
    figure = Figure(figsize=(3.2 * (count + 2), 3.9 * len(heights)), layout="constrained")
    axes = figure.subplots(len(heights), count + 2, squeeze=False, sharex=True, sharey=True)
    for layer, row in zip(range(len(heights)), axes[::-1], strict=True):
        _draw_row(row, arrays, layer, actions)
        level = f", {terms.target} {heights[layer]:+g} m" if len(heights) > 1 else ""
        row[0].set_ylabel(f"metres ahead{level}")
    figure.colorbar(axes[0, 0].images[0], ax=axes[:, :count], shrink=0.8, label="probability")
    for axis in axes[-1]:
        axis.set_xlabel("metres to the left (+) or right (-)", fontsize=9)
    named = ([actions.css(action) for action in range(count)], actions.names)
    ends = (_OUTCOMES, [f"{terms.target} {what}" for what in (terms.unhandled, terms.handled)])
    for axis, labels in ((axes[-1, -2], named), (axes[-1, -1], ends)):
        handles = [Patch(color=c, label=n) for c, n in zip(*labels, strict=True)]
        axis.legend(
            handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, fontsize=8,
            frameon=False,
        )  # fmt: skip
    return figure


def _draw_row(
    axes: Sequence[Axes], arrays: dict[str, NDArray], layer: int, actions: ShownActions
) -> None:
    """The maps of one height: one an action, the chosen action, what comes of it."""
    forward, lateral = arrays["response_forward"], arrays["response_lateral"]
    probabilities = arrays["response_probabilities"][layer]
    extent = (lateral[0], lateral[-1], forward[0], forward[-1])
    style: dict[str, Any] = {
        "extent": extent, "origin": "lower", "aspect": "auto", "interpolation": "nearest",
    }  # fmt: skip
    *wishes, most, outcome = axes
    for axis, action in zip(wishes, actions.order, strict=True):
        axis.imshow(probabilities[..., action], vmin=0, vmax=1, cmap="viridis", **style)
        axis.set_title(f"P({actions.names[action]})")
    shades = ListedColormap([actions.css(action) for action in range(len(wishes))])
    most.imshow(probabilities.argmax(-1), vmin=0, vmax=len(wishes) - 1, cmap=shades, **style)
    most.set_title("most probable action\n(in the white line: blind)", fontsize=10)
    blind = arrays["response_blind"][layer]
    if blind.any():
        most.contour(
            lateral, forward, blind.astype(float), levels=[0.5], colors="white", linewidths=2.5
        )
    ends = ListedColormap(_OUTCOMES)
    outcome.imshow(arrays["outcome_collected"][layer], vmin=0, vmax=1, cmap=ends, **style)
    outcome.set_title("what comes of it", fontsize=10)


def tables(explanation: Explanation) -> dict[str, Rows]:
    """What it does, and what comes of it, at each place."""
    arrays = explanation.arrays
    names = explanation.actions.names
    place = ["metres_up", "metres_ahead", "metres_left"]
    does: list[list[Any]] = [[*place, *(f"p_{a}" for a in names), "needed", "blind"]]
    for at, where in _grid(arrays, "response"):
        shares = arrays["response_probabilities"][at].round(5).tolist()
        action = int(arrays["response_oracle"][at[-1]])
        needed = names[action] if action >= 0 else ""
        does.append([*where, *shares, needed, int(arrays["response_blind"][at])])
    comes: list[list[Any]] = [[*place, "collected"]]
    for at, where in _grid(arrays, "outcome"):
        comes.append([*where, int(arrays["outcome_collected"][at])])
    return {"response": does, "outcomes": comes}


def _grid(
    arrays: dict[str, NDArray], name: str
) -> Iterator[tuple[tuple[int, ...], tuple[float, ...]]]:
    """Every index of a map with its place in metres: up, ahead, to the left."""
    axes = [arrays[f"{name}_{axis}"] for axis in ("height", "forward", "lateral")]
    for at in np.ndindex(*(len(axis) for axis in axes)):
        yield at, tuple(round(float(axis[i]), 3) for axis, i in zip(axes, at, strict=True))


PART = Part(
    title="What it does about one thing alone, wherever that stands",
    label="Response map",
    place=80,
    needs=("response",),
    words={"response": RESPONSE},
    draw=lambda explanation: {"response": response_chart(explanation)},
    tables=tables,
)
