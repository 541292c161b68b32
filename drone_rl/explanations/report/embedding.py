"""Report section "tsne": t-SNE maps of frames (Figs. 7 and 8)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.results import Explanation, Tsne
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import to_png, to_uri
from drone_rl.utils.palette import Rgb

MAX_THUMBNAILS = 900  # if there are more frames, an evenly spaced selection is shown
CELLS_A_THUMBNAIL = 2.2  # empty cells show where clusters end
ASPECT = 1.5  # width to height of a map of thumbnails
TILES_ACROSS = 30  # frames in a row of the sprite, as map.js cuts it


def thumbnail_map(frames: NDArray, points: NDArray, colors: Sequence[Rgb]) -> Image.Image:
    """Return a map of frames (T, H, W, 3) at their points (T, 2), each tinted in its color."""
    index = shown_frames(len(frames))
    tints = [colors[i] for i in index]
    return images.thumbnails(frames[index], tints, cells(frames, points))


def shown_frames(count: int) -> NDArray:
    """Return the frames that get a thumbnail. Shape: (N,)."""
    return np.unique(np.linspace(0, count - 1, min(count, MAX_THUMBNAILS)).astype(int))


def cells(frames: NDArray, points: NDArray) -> NDArray:
    """Return column and row of each shown frame. Shape: (N, 2)."""
    index = shown_frames(len(frames))
    tile = frames.shape[2] / frames.shape[1]
    rows = int(np.ceil(np.sqrt(CELLS_A_THUMBNAIL * len(index) * tile / ASPECT)))
    columns = int(np.ceil(CELLS_A_THUMBNAIL * len(index) / rows))
    return snap_to_grid(points[index], columns, rows)


def snap_to_grid(points: NDArray, columns: int, rows: int) -> NDArray:
    """Assign each point its own cell, at the least squared distance: column and row. (T, 2)."""
    low, high = points.min(0), points.max(0)
    scaled = (points - low) / np.maximum(high - low, 1e-12) * (columns - 1, rows - 1)
    corners = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2)
    _, nearest = linear_sum_assignment(cdist(scaled, corners, "sqeuclidean"))
    return corners[nearest]


def draw(tsne: Tsne, explanation: Explanation) -> dict[str, Image.Image]:
    """Draw the maps of features and of pixels, tinted by the action taken."""
    data = explanation.data
    colors = [explanation.actions.colors[action] for action in data["actions"]]
    return {f"tsne_{name}": thumbnail_map(data["frames"], one.points, colors) for name, one in tsne}


def interactive_map(tsne: Tsne, explanation: Explanation) -> dict[str, Any]:
    """Return the data of each shown frame that the interactive map uses."""
    data, actions, terms = explanation.data, explanation.actions, explanation.terms
    frames, index = data["frames"], shown_frames(len(data["actions"]))
    tiles = [Image.fromarray(frame) for frame in frames[index]]
    sprite = images.gridded(tiles, TILES_ACROSS, gap=0).quantize(128, dither=Image.Dither.NONE)
    events = {1: f"{terms.reaches} a {terms.goal}", -1: f"misses a {terms.goal}"}
    return {
        "tile": [frames.shape[2], frames.shape[1]],
        "cells": {name: cells(frames, one.points).tolist() for name, one in tsne},
        "action": data["actions"][index].tolist(),
        "probabilities": np.round(data["probabilities"][index].astype(float), 3).tolist(),
        "episode": data["episode"][index].tolist(),
        "step": data["step"][index].tolist(),
        "event": [events.get(event, "") for event in data["event"][index].tolist()],
        "last": (np.bincount(data["flights/episode"]) - 1).tolist(),
        "names": actions.names,
        "order": actions.order,
        "colors": actions.colors,
        "sprite": to_uri(to_png(sprite), "image/png"),
    }


PART = Part(
    title="Frames by similarity (t-SNE)",
    label="t-SNE",
    draw=draw,
    values=lambda *of: {"points": interactive_map(*of)},
)
