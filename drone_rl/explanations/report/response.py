"""Report sections "response" (maps over one target's place) and "asymmetry"."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.results import Asymmetry, Explanation, Response, TargetGrid
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import new_chart
from drone_rl.utils.palette import EMPTY, GOOD, css


def response_charts(result: Response, explanation: Explanation) -> dict[str, Figure]:
    """Plot over the target's place: the actions' probabilities, the best action, the outcome.

    Each height of targets has its own charts, the highest first.
    """
    actions, terms = explanation.actions, explanation.terms
    grid, names, heights = result.map, actions.names, result.map.height
    colors = {name: actions.css(number) for number, name in enumerate(names)}
    ends = {f"{terms.target} {terms.unhandled}": css(EMPTY)}
    ends[f"{terms.target} {terms.handled}"] = css(GOOD)
    charts: dict[str, Figure] = {}
    for level in reversed(range(len(heights))):
        suffix = f", {terms.target} {heights[level]:+g} m" if len(heights) > 1 else ""
        probabilities, blind = grid.probabilities[level], grid.blind[level]
        for action in actions.order:
            title = f"P({names[action]}){suffix}"
            charts[title] = _map(grid, probabilities[..., action], title)
        title = f"most probable action{suffix}"
        title += "; white line: no reaction" if blind.any() else ""
        charts[title] = chart = _map(grid, probabilities.argmax(-1), title, colors)
        if blind.any():
            lines = {"levels": [0.5], "colors": "white", "linewidths": 2.5}
            chart.axes[0].contour(grid.lateral, grid.forward, blind, **lines)
        title = f"outcome{suffix}"
        charts[title] = _map(result.outcome, result.outcome.collected[level], title, ends)
    return charts


def _map(
    grid: TargetGrid, values: NDArray, title: str, colors: dict[str, str] | None = None
) -> Figure:
    """Plot probabilities at each place of a grid, or indices of named colors. Shape: (F, L)."""
    figure, axis = new_chart(height=4.4)
    shades = ListedColormap([*colors.values()]) if colors else "viridis"
    mesh = axis.pcolormesh(
        _edges(grid.lateral),
        _edges(grid.forward),
        values,
        cmap=shades,
        vmin=0,
        vmax=len(colors) - 1 if colors else 1,
        rasterized=True,
    )
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


def worst_frames(result: Asymmetry, explanation: Explanation) -> dict[str, Image.Image]:
    """Return the frames on which the policy and its mirror image differ most, by caption."""
    data, actions = explanation.data, explanation.actions
    worst = {f"frame {one.frame}: differs by {one.distance:.2f}": one.frame for one in result.worst}
    return {c: images.frame_with_probabilities(data, f, c, actions) for c, f in worst.items()}


RESPONSE_PART = Part(
    title="Response to one target by its place",
    label="Response map",
    draw=lambda *of: {"response": response_charts(*of)},
)
ASYMMETRY_PART = Part(
    title="Left-right asymmetry",
    label="Asymmetry",
    draw=lambda *of: {"asymmetry": worst_frames(*of)},
)
