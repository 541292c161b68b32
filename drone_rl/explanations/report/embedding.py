"""Report section "embedding": t-SNE maps of frames (Figs. 7 and 8)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import to_png, to_uri
from drone_rl.utils.text import Claims, Evidence, listed, percent

MAX_THUMBNAILS = 900  # if there are more frames, an evenly spaced selection is shown
CELLS_A_THUMBNAIL = 2.2  # empty cells show where clusters end
ASPECT = 1.5  # width to height of a map of thumbnails
TILES_ACROSS = 30  # frames in a row of the sprite, as map.js cuts it
MAPS = ("features", "pixels")


def say_embedding(evidence: Evidence) -> Claims:
    """Say how well the maps keep neighbourhoods."""
    maps = evidence["tsne"]
    parts = [
        f"on the map of {name} {percent(maps[name]['neighbours_kept'])} (chance: "
        f"{percent(maps[name]['neighbours_chance'])}; trustworthiness "
        f"{maps[name]['trustworthiness']:.3f} of 1)"
        for name in MAPS
    ]
    return {
        "tsne.faithful": (
            f"Of the {maps['features']['neighbours']} nearest neighbours of a frame "
            f"{listed(parts)} are nearest neighbours in the original space."
        )
    }


def tsne_map(explanation: Explanation, which: str) -> Image.Image:
    """Return a map of thumbnails at their embedded positions, tinted by action."""
    index = shown_frames(explanation)
    colors = [explanation.actions.colors[a] for a in explanation.data["actions"][index]]
    frames = explanation.data["frames"][index]
    return images.thumbnails(frames, colors, cells(explanation, which))


def shown_frames(explanation: Explanation) -> NDArray:
    """Return the frames that get a thumbnail. Shape: (N,)."""
    count = len(explanation.data["actions"])
    return np.unique(np.linspace(0, count - 1, min(count, MAX_THUMBNAILS)).astype(int))


def cells(explanation: Explanation, which: str) -> NDArray:
    """Return column and row of each shown frame. Shape: (N, 2)."""
    frames = explanation.data["frames"]
    index = shown_frames(explanation)
    tile = frames.shape[2] / frames.shape[1]
    rows = int(np.ceil(np.sqrt(CELLS_A_THUMBNAIL * len(index) * tile / ASPECT)))
    columns = int(np.ceil(CELLS_A_THUMBNAIL * len(index) / rows))
    return snap_to_grid(explanation.arrays[f"tsne_{which}"][index], columns, rows)


def snap_to_grid(points: NDArray, columns: int, rows: int) -> NDArray:
    """Assign each point its own cell, at the least squared distance: column and row. (T, 2)."""
    low, high = points.min(0), points.max(0)
    scaled = (points - low) / np.maximum(high - low, 1e-12) * (columns - 1, rows - 1)
    corners = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2)
    _, nearest = linear_sum_assignment(cdist(scaled, corners, "sqeuclidean"))
    return corners[nearest]


def sprite(explanation: Explanation) -> Image.Image:
    """Return all shown frames in one image, for the interactive map."""
    frames = explanation.data["frames"][shown_frames(explanation)]
    sheet = images.gridded([*map(Image.fromarray, frames)], TILES_ACROSS, gap=0)
    return sheet.quantize(128, dither=Image.Dither.NONE)


def points(explanation: Explanation) -> dict[str, Any]:
    """Return the data of each shown frame that the interactive map uses."""
    data, index = explanation.data, shown_frames(explanation)
    height, width = data["frames"].shape[1:3]
    last, terms = np.bincount(data["flights/episode"]) - 1, explanation.terms
    events = {1: f"{terms.reaches} a {terms.goal}", -1: f"misses a {terms.goal}"}
    return {
        "tile": [width, height],
        "cells": {which: cells(explanation, which).tolist() for which in MAPS},
        "action": data["actions"][index].tolist(),
        "probabilities": np.round(data["probabilities"][index].astype(float), 3).tolist(),
        "episode": data["episode"][index].tolist(),
        "step": data["step"][index].tolist(),
        "event": [events.get(event, "") for event in data["event"][index].tolist()],
        "last": last.tolist(),
        "names": explanation.actions.names,
        "order": explanation.actions.order,
        "colors": explanation.actions.colors,
        "sprite": to_uri(to_png(sprite(explanation)), "image/png"),
    }


PART = Part(
    title="Frames by similarity (t-SNE)",
    label="t-SNE",
    needs=("tsne",),
    text={"tsne": say_embedding},
    draw=lambda explanation: {f"tsne_{which}": tsne_map(explanation, which) for which in MAPS},
    extras=lambda explanation: {"points": points(explanation)},
)
