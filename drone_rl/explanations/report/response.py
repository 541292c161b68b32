"""Report sections "response" (maps over one target's place) and "asymmetry"."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.sim.vocabulary import terms_of
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import new_chart
from drone_rl.utils.palette import EMPTY, GOOD, css
from drone_rl.utils.text import Claims, Evidence, bounds, listed, percent


def say_response(evidence: Evidence) -> Claims:
    """Say from where targets are handled, and where the policy is blind to them."""
    rows, terms, claims = evidence["response"]["rows"], terms_of(evidence), Claims()
    by_height: dict[float, list[str]] = {}
    for row in rows:
        if row["places"]:
            counts = f"{row['collected']} of {row['places']} places {terms.place(row['side'])}"
            by_height.setdefault(row["height"], []).append(counts)
    if by_height:
        outcomes = [
            f"from {listed(counts)}" + (f" with the {terms.target} at {up:+g} m" if up else "")
            for up, counts in sorted(by_height.items(), key=lambda item: abs(item[0]))
        ]
        claims["response.collected"] = (
            f"Taking its most probable actions with one {terms.target} alone, the policy "
            f"{terms.handles} {'; '.join(outcomes)}."
        )
    blind = {
        row["side"]: row["blind"] for row in rows if row["height"] == 0 and row["side"] != "ahead"
    }
    if blind and None not in blind.values():
        parts = [f"{percent(of)} of the places {terms.place(side)}" for side, of in blind.items()]
        claims["response.blind"] = (
            f"It is blind at {listed(parts)}: a turn is needed, its action is not to this side, "
            f"and its probabilities differ by less than {evidence['response']['blind_below']:g} "
            f"from those without a {terms.target}. It may still detect the {terms.target} farther "
            "on."
        )
    return claims


def say_asymmetry(evidence: Evidence) -> Claims:
    """Say how far the policy differs from its mirror image, and which side it prefers."""
    on_frames, on_grid = evidence["asymmetry"]["dataset"], evidence["asymmetry"]["grid"]
    absolute, signed = on_frames["absolute"], on_frames["signed"]
    return {
        "asymmetry.differs": (
            "On these frames the policy differs from its mirror image by "
            f"{absolute['mean']:.2f} on average (0: perfectly symmetric, 1: always opposite; "
            f"{bounds(absolute)}), over the places of the response map by "
            f"{on_grid['absolute']:.2f}."
        ),
        "asymmetry.side": (
            f"Its preference for left over right is {signed['mean']:+.2f} in probability "
            f"({bounds(signed, '{:+.2f}'.format)}; below 0: right)."
        ),
    }


def response_charts(explanation: Explanation) -> dict[str, Figure]:
    """Plot over the target's place: the actions' probabilities, the best action, the outcome.

    Each height of targets has its own charts, the highest first.
    """
    arrays, actions, terms = explanation.arrays, explanation.actions, explanation.terms
    heights, names = arrays["response_height"], actions.names
    colors = {name: actions.css(number) for number, name in enumerate(names)}
    ends = {f"{terms.target} {terms.unhandled}": css(EMPTY)}
    ends[f"{terms.target} {terms.handled}"] = css(GOOD)
    charts: dict[str, Figure] = {}
    for level in reversed(range(len(heights))):
        suffix = f", {terms.target} {heights[level]:+g} m" if len(heights) > 1 else ""
        probabilities = arrays["response_probabilities"][level]
        for action in actions.order:
            title = f"P({names[action]}){suffix}"
            charts[title] = _map(arrays, "response", probabilities[..., action], title)
        title, blind = f"most probable action{suffix}", arrays["response_blind"][level]
        if blind.any():
            title += "; inside the white line: blind"
        chart = _map(arrays, "response", probabilities.argmax(-1), title, colors)
        if blind.any():
            at = arrays["response_lateral"], arrays["response_forward"]
            chart.axes[0].contour(*at, blind, levels=[0.5], colors="white", linewidths=2.5)
        charts[title] = chart
        title = f"outcome{suffix}"
        charts[title] = _map(arrays, "outcome", arrays["outcome_collected"][level], title, ends)
    return charts


def _map(
    arrays: dict[str, NDArray],
    grid: str,
    values: NDArray,
    title: str,
    colors: dict[str, str] | None = None,
) -> Figure:
    """Plot probabilities at each place of a grid, or indices of named colors. Shape: (F, L)."""
    figure, axis = new_chart(height=4.4)
    edges = [_edges(arrays[f"{grid}_{name}"]) for name in ("lateral", "forward")]
    shades = ListedColormap([*colors.values()]) if colors else "viridis"
    top = len(colors) - 1 if colors else 1
    mesh = axis.pcolormesh(*edges, values, cmap=shades, vmin=0, vmax=top, rasterized=True)
    axis.set(ylabel="metres ahead", xlabel="metres to the left (+) or right (-)")
    axis.set_title(title, fontsize=11)
    if colors:
        handles = [Patch(color=color, label=name) for name, color in colors.items()]
        figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    else:
        figure.colorbar(mesh, ax=axis, shrink=0.8, label="probability")
    return figure


def _edges(middles: NDArray) -> NDArray:
    """Return the edges of cells whose middles are equally spaced."""
    half = (middles[-1] - middles[0]) / max(1, len(middles) - 1) / 2 or 0.5
    return np.append(middles - half, middles[-1] + half)


def worst_frames(explanation: Explanation) -> dict[str, Image.Image]:
    """Return the three frames on which the policy and its mirror image differ most, by caption."""
    worst = explanation.numbers["asymmetry"]["dataset"]["worst"][:3]
    captions = {f"frame {one['frame']}: differs by {one['distance']:.2f}": one for one in worst}
    return {
        caption: images.frame_with_probabilities(
            explanation.data, one["frame"], caption, explanation.actions
        )
        for caption, one in captions.items()
    }


RESPONSE_PART = Part(
    title="Response to one target by its place",
    label="Response map",
    needs=("response",),
    text={"response": say_response},
    draw=lambda explanation: {"response": response_charts(explanation)},
)
ASYMMETRY_PART = Part(
    title="Left-right asymmetry",
    label="Asymmetry",
    needs=("asymmetry",),
    text={"asymmetry": say_asymmetry},
    draw=lambda explanation: {"asymmetry": worst_frames(explanation)},
)
