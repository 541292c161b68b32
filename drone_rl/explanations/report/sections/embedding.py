"""Maps of frames, laid out by likeness (Figs. 7 and 8)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.evaluation.plots import images as pictures
from drone_rl.evaluation.plots.saving import Rows, to_png, to_uri
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.text import TSNE
from drone_rl.explanations.tsne import snap_to_grid

MOST_THUMBNAILS = 900
"""More frames than this are shown evenly thinned out."""
ROOM = 2.2
"""Cells to a thumbnail: gaps show where clusters end."""
ASPECT = 1.5
"""Width to height of a map of thumbnails."""
TILES_ACROSS = 30
"""Frames in a row of the sprite, as map.js cuts it."""
MAPS = ("features", "pixels")


def draw(explanation: Explanation) -> dict[str, Image.Image]:
    """A map of each kind."""
    return {f"tsne_{which}": tsne_map(explanation, which) for which in MAPS}


def tsne_map(explanation: Explanation, which: str) -> Image.Image:
    """Thumbnails where the embedding puts them, tinted by action."""
    chosen = shown_frames(explanation)
    return pictures.thumbnails(
        explanation.data["frames"][chosen],
        [explanation.actions.colors[a] for a in explanation.data["actions"][chosen]],
        cells(explanation, which),
    )


def shown_frames(explanation: Explanation) -> NDArray:
    """Frames that get a thumbnail. Shape: (N,)."""
    count = len(explanation.data["actions"])
    return np.unique(np.linspace(0, count - 1, min(count, MOST_THUMBNAILS)).astype(int))


def cells(explanation: Explanation, which: str) -> NDArray:
    """Column and row of each shown frame. Shape: (N, 2)."""
    frames = explanation.data["frames"]
    chosen = shown_frames(explanation)
    tile = frames.shape[2] / frames.shape[1]
    rows = int(np.ceil(np.sqrt(ROOM * len(chosen) * tile / ASPECT)))
    columns = int(np.ceil(ROOM * len(chosen) / rows))
    return snap_to_grid(explanation.arrays[f"tsne_{which}"][chosen], columns, rows)


def sprite(explanation: Explanation) -> Image.Image:
    """All shown frames in one picture, for the interactive map."""
    frames = explanation.data["frames"][shown_frames(explanation)]
    height, width = frames.shape[1:3]
    canvas = Image.new("RGB", (TILES_ACROSS * width, -(-len(frames) // TILES_ACROSS) * height))
    for i, frame in enumerate(frames):
        corner = (i % TILES_ACROSS * width, i // TILES_ACROSS * height)
        canvas.paste(Image.fromarray(frame), corner)
    return canvas.quantize(128, dither=Image.Dither.NONE)


def points(explanation: Explanation) -> dict[str, Any]:
    """What the interactive map needs to know of each shown frame."""
    data, chosen = explanation.data, shown_frames(explanation)
    height, width = data["frames"].shape[1:3]
    last = np.bincount(data["flights/episode"]) - 1
    return {
        "tile": [width, height],
        "cells": {which: cells(explanation, which).tolist() for which in MAPS},
        "action": data["actions"][chosen].tolist(),
        "probabilities": np.round(data["probabilities"][chosen].astype(float), 3).tolist(),
        "episode": data["episode"][chosen].tolist(),
        "step": data["step"][chosen].tolist(),
        "event": [_event(explanation, int(event)) for event in data["event"][chosen]],
        "last": last.tolist(),
        "names": explanation.actions.names,
        "order": explanation.actions.order,
        "colors": explanation.actions.colors,
        "sprite": to_uri(to_png(sprite(explanation)), "image/png"),
    }


def _event(explanation: Explanation, event: int) -> str:
    terms = explanation.terms
    return {1: f"{terms.reaches} a {terms.goal}", -1: f"misses a {terms.goal}"}.get(event, "")


def _legend(explanation: Explanation) -> list[dict[str, str]]:
    actions = explanation.actions
    return [{"name": n, "color": actions.css(i)} for i, n in enumerate(actions.names)]


def table(explanation: Explanation) -> Rows:
    """Each frame's place on both maps."""
    data, arrays = explanation.data, explanation.arrays
    axes = [f"{axis}_{which}" for which in MAPS for axis in ("x", "y")]
    both = np.hstack([arrays[f"tsne_{which}"] for which in MAPS]).round(4).tolist()
    rows: list[list[Any]] = [["frame", "episode", "step", "action", *axes]]
    for t, row in enumerate(both):
        action = explanation.actions.names[int(data["actions"][t])]
        rows.append([t, int(data["episode"][t]), int(data["step"][t]), action, *row])
    return rows


PART = Part(
    title="What the policy sees, laid out by likeness (t-SNE)",
    label="t-SNE",
    place=30,
    needs=("tsne",),
    is_slow=True,
    words={"tsne": TSNE},
    draw=draw,
    tables=lambda explanation: {"tsne": table(explanation)},
    extras=lambda explanation: {
        "actions": _legend(explanation),
        "points": points(explanation),
    },
)
