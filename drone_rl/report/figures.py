"""The figures of one explanation, and the numbers that are saved beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explain.tsne import lay_out
from drone_rl.report import pictures, plots
from drone_rl.report.explanation import ACTIONS, Explanation

MOST_THUMBNAILS = 900
"""More frames than this are shown evenly thinned out."""
ROOM = 2.2
"""Cells to a thumbnail: gaps show where clusters end."""
ASPECT = 1.5
"""Width to height of a map of thumbnails."""
SHAPE_OF_ACTIONS = (1, 0, 2)
"""The order in which actions are shown: left, forward, right."""


def draw_all(explanation: Explanation) -> dict[str, Image.Image | Figure]:
    """Every figure of one policy, by name."""
    drawn: dict[str, Image.Image | Figure] = {
        "tsne_features": tsne_map(explanation, "features"),
        "tsne_pixels": tsne_map(explanation, "pixels"),
        "class_model": class_model_grid([explanation]),
        "sequence": sequence(explanation),
        "truth": plots.truth_chart(explanation),
        "interventions": interventions(explanation),
        "response": plots.response_chart(explanation),
        "asymmetry": asymmetry(explanation),
    }
    for name, wanted in (("contradictions", True), ("justified", False)):
        found = pairs(explanation, wanted)
        if found is not None:
            drawn[name] = found
    return drawn


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
    return lay_out(explanation.arrays[f"tsne_{which}"][chosen], columns, rows)


def tsne_map(explanation: Explanation, which: str) -> Image.Image:
    """Thumbnails where the embedding puts them, tinted by action (Figs. 7 and 8)."""
    chosen = shown_frames(explanation)
    return pictures.thumbnails(
        explanation.data["frames"][chosen],
        explanation.data["actions"][chosen],
        cells(explanation, which),
    )


def sprite(explanation: Explanation) -> Image.Image:
    """All shown frames in one picture, 30 in a row, for the interactive map."""
    frames = explanation.data["frames"][shown_frames(explanation)]
    number = np.arange(len(frames))
    height, width = frames.shape[1:3]
    canvas = Image.new("RGB", (30 * width, -(-len(frames) // 30) * height))
    for i, frame in zip(number, frames, strict=True):
        canvas.paste(Image.fromarray(frame), (int(i % 30) * width, int(i // 30) * height))
    return canvas.quantize(128, dither=Image.Dither.NONE)


def points(explanation: Explanation) -> dict[str, Any]:
    """What the interactive map needs to know of each shown frame."""
    data, chosen = explanation.data, shown_frames(explanation)
    height, width = data["frames"].shape[1:3]
    last = {
        int(e): int(data["step"][data["episode"] == e].max()) for e in np.unique(data["episode"])
    }
    return {
        "tile": [width, height],
        "cells": {w: cells(explanation, w).tolist() for w in ("features", "pixels")},
        "action": data["actions"][chosen].tolist(),
        "probabilities": np.round(data["probabilities"][chosen].astype(float), 3).tolist(),
        "episode": data["episode"][chosen].tolist(),
        "step": data["step"][chosen].tolist(),
        "reward": data["rewards"][chosen].tolist(),
        "last": last,
    }


def pairs(explanation: Explanation, contradiction: bool, most: int = 4) -> Image.Image | None:
    """Alike frames with opposite actions, side by side (Fig. 9); None if there is none."""
    found = [
        pair
        for pair in explanation.numbers["contradictions"]["list"]
        if pair["contradiction"] == contradiction
    ][:most]
    if not found:
        return None
    tiles = [
        _probed_frame(explanation, pair[side], f"frame {pair[side]}: more {side}")
        for pair in found
        for side in ("left", "right")
    ]
    return pictures.gridded(tiles, 2)


def class_model_grid(explanations: Sequence[Explanation]) -> Image.Image:
    """Actions across, policies and objectives down, the probability reached over each picture."""
    tiles = []
    for explanation in explanations:
        statistics = explanation.numbers["class_model"]["statistics"]
        for objective in ("probability", "logit"):
            found = explanation.numbers["class_model"][objective]
            shown = explanation.arrays[f"class_model_{objective}"]
            for action in SHAPE_OF_ACTIONS:
                gray = pictures.gray_picture(shown[action], statistics["low"], statistics["high"])
                reached = found["probabilities"][action]
                who = f"{explanation.name[:18]}: " if len(explanations) > 1 else ""
                caption = f"{who}{ACTIONS[action]} {reached:.3f} (by {objective})"
                tiles.append(pictures.titled(pictures.enlarge(gray), caption))
    return pictures.gridded(tiles, 3)


def sequence(explanation: Explanation) -> Image.Image:
    """Six frames of an episode with Grad-CAM and the indicator (Figs. 13 to 15)."""
    tiles = [
        _explained(explanation, entry["frame"], f"{i}. {entry['why']}")
        for i, entry in enumerate(explanation.numbers["attribution"]["sequence"], start=1)
    ]
    return pictures.gridded(tiles, 3)


def episode_video(explanation: Explanation) -> NDArray:
    """The whole episode with heat map and indicator. Shape: (T, H, W, 3), uint8, even sizes."""
    episode = explanation.numbers["attribution"]["episode"]
    frames = np.flatnonzero(explanation.data["episode"] == episode)
    shots = [np.asarray(_explained(explanation, int(t), f"step {i}")) for i, t in enumerate(frames)]
    video = np.stack(shots)
    height, width = (-(-n // 16) * 16 for n in video.shape[1:3])  # what the encoder wants
    wide = np.full((len(video), height, width, 3), 255, np.uint8)
    wide[:, : video.shape[1], : video.shape[2]] = video
    return wide


def interventions(explanation: Explanation) -> Image.Image:
    """One frame and what each change to the scene made of it."""
    truth = explanation.numbers["truth"]
    before = explanation.data["frames"][truth["shown_frame"]]
    tiles = [pictures.titled(pictures.enlarge(before), "as it was")]
    for name, frame in zip(
        truth["interventions"], explanation.arrays["interventions"], strict=True
    ):
        effect = truth["interventions"][name]["mean"]
        told = "no effect measured" if effect is None else f"mean effect {effect:.2f}"
        tiles.append(pictures.titled(pictures.enlarge(frame), f"{name}: {told}"))
    return pictures.gridded(tiles, 3)


def asymmetry(explanation: Explanation) -> Image.Image:
    """The frames on which the policy and its mirror image differ most."""
    worst = explanation.numbers["asymmetry"]["dataset"]["worst"][:3]
    tiles = [
        _probed_frame(explanation, entry["frame"], f"differs by {entry['distance']:.2f}")
        for entry in worst
    ]
    return pictures.gridded(tiles, 3)


def tables(explanation: Explanation) -> dict[str, list[list[Any]]]:
    """Numbers behind figures, as rows of CSV files."""
    data, arrays = explanation.data, explanation.arrays
    tsne = [
        ["frame", "episode", "step", "action", "x_features", "y_features", "x_pixels", "y_pixels"]
    ]
    both = np.hstack([arrays["tsne_features"], arrays["tsne_pixels"]]).round(4).tolist()
    for t, row in enumerate(both):
        action = ACTIONS[int(data["actions"][t])]
        tsne.append([t, int(data["episode"][t]), int(data["step"][t]), action, *row])
    response = [["metres_ahead", "metres_left", *(f"p_{a}" for a in ACTIONS), "oracle", "blind"]]
    for i, ahead in enumerate(arrays["response_forward"]):
        for j, left in enumerate(arrays["response_lateral"]):
            shares = arrays["response_probabilities"][i, j].round(5).tolist()
            oracle = ACTIONS[int(arrays["response_oracle"][i, j])]
            blind = int(arrays["response_blind"][i, j])
            response.append([round(float(ahead), 3), round(float(left), 3), *shares, oracle, blind])
    return {"tsne": tsne, "response": response}


def numbers(explanation: Explanation) -> dict[str, Any]:
    """Numbers behind figures, as JSON files."""
    names = (
        "verdict",
        "contradictions",
        "loops",
        "class_model",
        "attribution",
        "truth",
        "asymmetry",
    )
    return {name: explanation.numbers[name] for name in names}


def _heat(explanation: Explanation, frame: int) -> NDArray:
    """Grad-CAM of a frame, of the logit where the probability's has none; else saliency."""
    for name in ("map_grad_cam", "map_grad_cam_logit", "map_saliency"):
        if name in explanation.arrays and explanation.arrays[name][frame].max() > 0:
            return explanation.arrays[name][frame]
    return explanation.arrays["map_saliency"][frame]


def _explained(explanation: Explanation, frame: int, caption: str) -> Image.Image:
    data = explanation.data
    return pictures.explained_frame(
        data["frames"][frame],
        _heat(explanation, frame),
        data["probabilities"][frame],
        int(data["actions"][frame]),
        caption,
    )


def _probed_frame(explanation: Explanation, frame: int, caption: str) -> Image.Image:
    data = explanation.data
    plain = pictures.titled(pictures.enlarge(data["frames"][frame]), caption)
    chosen = int(data["actions"][frame])
    bars = pictures.indicator(data["probabilities"][frame], chosen, plain.width)
    return pictures.stacked([plain, bars])
