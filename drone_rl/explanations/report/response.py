"""Report sections "response" (maps over one target's place) and "asymmetry"."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.sim.vocabulary import ShownActions, TaskVocabulary, terms_of
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import Rows, new_chart
from drone_rl.utils.palette import EMPTY, GOOD, css
from drone_rl.utils.text import Claims, Evidence, bounds, listed, percent

_OUTCOMES = (css(EMPTY), css(GOOD))  # colors of unhandled and of handled targets


def say_response(evidence: Evidence) -> Claims:
    """Say from where targets are handled, and where the policy is blind to them."""
    rows, terms, claims = evidence["response"]["rows"], terms_of(evidence), Claims()
    level = [row for row in rows if row["height"] == 0]
    other = [row for row in rows if row["height"] != 0 and row["places"]]
    if any(row["places"] for row in level):
        claims["response.collected"] = (
            f"Taking its most probable actions with one {terms.target} alone, the policy "
            f"{terms.handles} from {_collected(level, terms)}."
        )
    if other:
        parts = [
            f"{abs(height):g} m {'higher' if height > 0 else 'lower'}: from "
            f"{_collected([row for row in other if row['height'] == height], terms)}"
            for height in sorted({row["height"] for row in other})
        ]
        claims["response.heights"] = f"With the {terms.target} {'; '.join(parts)}."
    blind = {row["side"]: row["blind"] for row in level if row["side"] != "ahead"}
    if blind and None not in blind.values():
        parts = [f"{percent(of)} of the places {terms.place(side)}" for side, of in blind.items()]
        claims["response.blind"] = (
            f"It is blind at {listed(parts)}: a turn is needed, its action is not to this side, "
            f"and its probabilities differ by less than {evidence['response']['blind_below']:g} "
            f"from those without a {terms.target}. It may still detect the {terms.target} farther "
            "on."
        )
    return claims


def _collected(rows: Sequence[Evidence], terms: TaskVocabulary) -> str:
    return listed(
        [
            f"{row['collected']} of {row['places']} places {terms.place(row['side'])}"
            for row in rows
            if row["places"]
        ]
    )


def say_asymmetry(evidence: Evidence) -> Claims:
    """Say how far the policy differs from its mirror image, and which side it prefers."""
    found = evidence["asymmetry"]["dataset"]
    absolute, signed = found["absolute"], found["signed"]
    on_grid = evidence["asymmetry"]["grid"]["absolute"]
    claims = {
        "asymmetry.differs": (
            "On these frames the policy differs from its mirror image by "
            f"{absolute['mean']:.2f} on average (0: perfectly symmetric, 1: always opposite; "
            f"{bounds(absolute)}), over the places of the response map by {on_grid:.2f}."
        )
    }
    if signed["lower95"] > 0 or signed["upper95"] < 0:
        side = "left" if signed["mean"] > 0 else "right"
        low, high = sorted(abs(signed[end]) for end in ("lower95", "upper95"))
        size = bounds({"lower95": low, "upper95": high})
        claims["asymmetry.prefers"] = (
            f"It prefers the {side}, by {abs(signed['mean']):.2f} in probability ({size})."
        )
    else:
        claims["asymmetry.undecided"] = (
            "These episodes do not show whether it prefers a side "
            f"({signed['mean']:+.2f}, {bounds(signed)}; above 0: left)."
        )
    return claims


def response_charts(explanation: Explanation) -> dict[str, Figure]:
    """Plot over the target's place: the actions' probabilities, the best action, the outcome.

    Each height of targets has its own charts, the highest first.
    """
    arrays, actions, terms = explanation.arrays, explanation.actions, explanation.terms
    heights, count = arrays["response_height"], len(explanation.actions.names)
    named = ([actions.css(action) for action in range(count)], actions.names)
    ends = (_OUTCOMES, [f"{terms.target} {what}" for what in (terms.unhandled, terms.handled)])
    charts: dict[str, Figure] = {}
    for level in reversed(range(len(heights))):
        panels = [new_chart(height=4.4) for _ in range(count + 2)]
        axes = [axis for _, axis in panels]
        _draw_maps(axes, arrays, level, actions)
        suffix = f", {terms.target} {heights[level]:+g} m" if len(heights) > 1 else ""
        for figure, axis in panels:
            axis.set(ylabel="metres ahead", xlabel="metres to the left (+) or right (-)")
            charts[f"{axis.get_title()}{suffix}"] = figure
            axis.set_title(f"{axis.get_title()}{suffix}", fontsize=11)
        for figure, axis in panels[:count]:
            figure.colorbar(axis.images[0], ax=axis, shrink=0.8, label="probability")
        for (figure, _), labels in zip(panels[count:], (named, ends), strict=True):
            handles = [Patch(color=c, label=n) for c, n in zip(*labels, strict=True)]
            figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    return charts


def _draw_maps(
    axes: Sequence[Axes], arrays: dict[str, NDArray], level: int, actions: ShownActions
) -> None:
    """Draw the maps of one height: one for each action, the best action, the outcome."""
    forward, lateral = arrays["response_forward"], arrays["response_lateral"]
    probabilities = arrays["response_probabilities"][level]
    style: dict[str, Any] = {
        **{"origin": "lower", "aspect": "auto", "interpolation": "nearest"},
        "extent": _extent(lateral, forward),
    }
    *panels, most, outcome = axes
    for axis, action in zip(panels, actions.order, strict=True):
        axis.imshow(probabilities[..., action], vmin=0, vmax=1, cmap="viridis", **style)
        axis.set_title(f"P({actions.names[action]})")
    shades = ListedColormap([actions.css(action) for action in range(len(panels))])
    most.imshow(probabilities.argmax(-1), vmin=0, vmax=len(panels) - 1, cmap=shades, **style)
    most.set_title("most probable action")
    blind = arrays["response_blind"][level]
    if blind.any():
        most.contour(
            lateral, forward, blind.astype(float), levels=[0.5], colors="white", linewidths=2.5
        )
        most.set_title("most probable action; inside the white line: blind")
    ends = ListedColormap(_OUTCOMES)
    style["extent"] = _extent(arrays["outcome_lateral"], arrays["outcome_forward"])
    outcome.imshow(arrays["outcome_collected"][level], vmin=0, vmax=1, cmap=ends, **style)
    outcome.set_title("outcome")


def _extent(lateral: NDArray, forward: NDArray) -> tuple[float, float, float, float]:
    """Return the outer edges of cells whose middles are equally spaced, as `imshow` needs them."""
    aside, ahead = ((a[-1] - a[0]) / max(1, len(a) - 1) / 2 or 0.5 for a in (lateral, forward))
    return lateral[0] - aside, lateral[-1] + aside, forward[0] - ahead, forward[-1] + ahead


def response_tables(explanation: Explanation) -> dict[str, Rows]:
    """Return the response and the outcome at each place."""
    arrays = explanation.arrays
    names = explanation.actions.names
    place = ["metres_up", "metres_ahead", "metres_left"]
    responses: list[list[Any]] = [[*place, *(f"p_{a}" for a in names), "needed", "blind"]]
    for at, where in _grid(arrays, "response"):
        shares = arrays["response_probabilities"][at].round(5).tolist()
        action = int(arrays["response_oracle"][at[-1]])
        needed = names[action] if action >= 0 else ""
        responses.append([*where, *shares, needed, int(arrays["response_blind"][at])])
    outcomes: list[list[Any]] = [[*place, "collected"]]
    outcomes += [
        [*where, int(arrays["outcome_collected"][at])] for at, where in _grid(arrays, "outcome")
    ]
    return {"response": responses, "outcomes": outcomes}


def _grid(
    arrays: dict[str, NDArray], name: str
) -> Iterator[tuple[tuple[int, ...], tuple[float, ...]]]:
    """Yield every index of a map with its place in metres: up, ahead, to the left."""
    axes = [arrays[f"{name}_{axis}"] for axis in ("height", "forward", "lateral")]
    for at in np.ndindex(*(len(axis) for axis in axes)):
        yield at, tuple(round(float(axis[i]), 3) for axis, i in zip(axes, at, strict=True))


def worst_frames(explanation: Explanation) -> dict[str, Image.Image]:
    """Return the three frames on which the policy and its mirror image differ most, by caption."""
    shown: dict[str, Image.Image] = {}
    for one in explanation.numbers["asymmetry"]["dataset"]["worst"][:3]:
        caption = f"frame {one['frame']}: differs by {one['distance']:.2f}"
        shown[caption] = images.frame_with_probabilities(
            explanation.data, one["frame"], caption, explanation.actions
        )
    return shown


RESPONSE_PART = Part(
    title="Response to one target by its place",
    label="Response map",
    needs=("response",),
    text={"response": say_response},
    draw=lambda explanation: {"response": response_charts(explanation)},
    tables=response_tables,
)
ASYMMETRY_PART = Part(
    title="Left-right asymmetry",
    label="Asymmetry",
    needs=("asymmetry",),
    text={"asymmetry": say_asymmetry},
    draw=lambda explanation: {"asymmetry": worst_frames(explanation)},
)
