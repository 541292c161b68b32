"""Report section "embedding": t-SNE maps of frames (Figs. 7 and 8)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import Rows, to_png, to_uri
from drone_rl.utils.text import Claims, Evidence, listed, percent

MAX_THUMBNAILS = 900  # if there are more frames, an evenly spaced selection is shown
CELLS_A_THUMBNAIL = 2.2  # empty cells show where clusters end
ASPECT = 1.5  # width to height of a map of thumbnails
TILES_ACROSS = 30  # frames in a row of the sprite, as map.js cuts it
MAPS = ("features", "pixels")


def say_embedding(evidence: Evidence) -> Claims:
    """Say how well the maps keep neighbourhoods."""
    one, two = (evidence["tsne"][name] for name in MAPS)
    claims = {
        "tsne.faithful": (
            f"Faithfulness of the maps: of the {one['neighbours']} nearest neighbours on a map, "
            f"{percent(one['neighbours_kept'])} (features of layer {one['layer']}) and "
            f"{percent(two['neighbours_kept'])} (pixels) are nearest neighbours in the "
            f"original space (chance: {percent(one['neighbours_chance'])} and "
            f"{percent(two['neighbours_chance'])}); trustworthiness "
            f"{one['trustworthiness']:.3f} and {two['trustworthiness']:.3f} of 1."
        )
    }
    unfaithful = [name for name in MAPS if evidence["tsne"][name]["neighbours_kept"] < 0.5]
    if unfaithful:
        claims["tsne.unfaithful"] = (
            f"Most neighbours on the map of {listed(unfaithful)} are not neighbours in the "
            "original space."
        )
    return claims


def tsne_map(explanation: Explanation, which: str) -> Image.Image:
    """Return a map of thumbnails at their embedded positions, tinted by action."""
    chosen = shown_frames(explanation)
    colors = [explanation.actions.colors[a] for a in explanation.data["actions"][chosen]]
    frames = explanation.data["frames"][chosen]
    return images.thumbnails(frames, colors, cells(explanation, which))


def shown_frames(explanation: Explanation) -> NDArray:
    """Return the frames that get a thumbnail. Shape: (N,)."""
    count = len(explanation.data["actions"])
    return np.unique(np.linspace(0, count - 1, min(count, MAX_THUMBNAILS)).astype(int))


def cells(explanation: Explanation, which: str) -> NDArray:
    """Return column and row of each shown frame. Shape: (N, 2)."""
    frames = explanation.data["frames"]
    chosen = shown_frames(explanation)
    tile = frames.shape[2] / frames.shape[1]
    rows = int(np.ceil(np.sqrt(CELLS_A_THUMBNAIL * len(chosen) * tile / ASPECT)))
    columns = int(np.ceil(CELLS_A_THUMBNAIL * len(chosen) / rows))
    return snap_to_grid(explanation.arrays[f"tsne_{which}"][chosen], columns, rows)


def snap_to_grid(points: NDArray, columns: int, rows: int) -> NDArray:
    """Assign each point its own cell, at the least squared distance: column and row. (T, 2)."""
    low, high = points.min(0), points.max(0)
    wanted = (points - low) / np.maximum(high - low, 1e-12) * (columns - 1, rows - 1)
    cells = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2)
    _, chosen = linear_sum_assignment(cdist(wanted, cells, "sqeuclidean"))
    return cells[chosen]


def sprite(explanation: Explanation) -> Image.Image:
    """Return all shown frames in one image, for the interactive map."""
    frames = explanation.data["frames"][shown_frames(explanation)]
    height, width = frames.shape[1:3]
    canvas = Image.new("RGB", (TILES_ACROSS * width, -(-len(frames) // TILES_ACROSS) * height))
    for i, frame in enumerate(frames):
        corner = (i % TILES_ACROSS * width, i // TILES_ACROSS * height)
        canvas.paste(Image.fromarray(frame), corner)
    return canvas.quantize(128, dither=Image.Dither.NONE)


def points(explanation: Explanation) -> dict[str, Any]:
    """Return the data of each shown frame that the interactive map uses."""
    data, chosen = explanation.data, shown_frames(explanation)
    height, width = data["frames"].shape[1:3]
    last, terms = np.bincount(data["flights/episode"]) - 1, explanation.terms
    events = {1: f"{terms.reaches} a {terms.goal}", -1: f"misses a {terms.goal}"}
    return {
        "tile": [width, height],
        "cells": {which: cells(explanation, which).tolist() for which in MAPS},
        "action": data["actions"][chosen].tolist(),
        "probabilities": np.round(data["probabilities"][chosen].astype(float), 3).tolist(),
        "episode": data["episode"][chosen].tolist(),
        "step": data["step"][chosen].tolist(),
        "event": [events.get(event, "") for event in data["event"][chosen].tolist()],
        "last": last.tolist(),
        "names": explanation.actions.names,
        "order": explanation.actions.order,
        "colors": explanation.actions.colors,
        "sprite": to_uri(to_png(sprite(explanation)), "image/png"),
    }


def table(explanation: Explanation) -> Rows:
    """Return the position of each frame on both maps."""
    data, arrays = explanation.data, explanation.arrays
    axes = [f"{axis}_{which}" for which in MAPS for axis in ("x", "y")]
    both = np.hstack([arrays[f"tsne_{which}"] for which in MAPS]).round(4).tolist()
    rows: list[list[Any]] = [["frame", "episode", "step", "action", *axes]]
    for t, row in enumerate(both):
        action = explanation.actions.names[int(data["actions"][t])]
        rows.append([t, int(data["episode"][t]), int(data["step"][t]), action, *row])
    return rows


PART = Part(
    title="Frames by similarity (t-SNE)",
    label="t-SNE",
    needs=("tsne",),
    is_slow=True,
    text={"tsne": say_embedding},
    draw=lambda explanation: {f"tsne_{which}": tsne_map(explanation, which) for which in MAPS},
    tables=lambda explanation: {"tsne": table(explanation)},
    extras=lambda explanation: {"points": points(explanation)},
)
