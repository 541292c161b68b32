"""The figures of one explanation, and the numbers that are saved beside them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explain.tsne import lay_out
from drone_rl.report import pictures, plots
from drone_rl.report.curves import curves_chart
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
        "curves": curves_chart(explanation),
        "heat": plots.heat_chart(explanation),
        "interventions": interventions(explanation),
        "response": plots.response_chart(explanation),
        "asymmetry": asymmetry(explanation),
    }
    for kind in ("contradiction", "justified", "unknown"):
        found = pairs(explanation, kind)
        if found is not None:
            drawn[f"pairs_{kind}"] = found
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
    last = np.bincount(data["flights/episode"]) - 1
    return {
        "tile": [width, height],
        "cells": {w: cells(explanation, w).tolist() for w in ("features", "pixels")},
        "action": data["actions"][chosen].tolist(),
        "probabilities": np.round(data["probabilities"][chosen].astype(float), 3).tolist(),
        "episode": data["episode"][chosen].tolist(),
        "step": data["step"][chosen].tolist(),
        "reward": data["rewards"][chosen].tolist(),
        "last": last.tolist(),
    }


def pairs(explanation: Explanation, kind: str, most: int = 4) -> Image.Image | None:
    """Alike frames with opposite actions, side by side (Fig. 9); None if there is none."""
    listed = explanation.numbers["contradictions"]["list"]
    found = [pair for pair in listed if pair["kind"] == kind][:most]
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
    """Six frames of a flight with Grad-CAM and the indicator (Figs. 13 to 15)."""
    tiles = [
        _explained(explanation, entry["step"], f"{i}. {entry['why']}")
        for i, entry in enumerate(explanation.numbers["attribution"]["film"]["key_steps"], start=1)
    ]
    return pictures.gridded(tiles, 3)


def episode_video(explanation: Explanation) -> NDArray:
    """The whole flight with heat map and indicator. Shape: (T, H, W, 3), uint8, even sizes."""
    steps = range(len(explanation.arrays["film_frames"]))
    video = np.stack([np.asarray(_explained(explanation, t, f"step {t}")) for t in steps])
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
        effect = truth["interventions"][name]
        told = "not tried"
        if effect["mean"] is not None:
            told = f"{effect['mean']:.2f} [{effect['lower95']:.2f}, {effect['upper95']:.2f}]"
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
    return {"tsne": tsne, "response": _response(arrays), "outcomes": _outcomes(arrays)}


def _response(arrays: dict[str, NDArray]) -> list[list[Any]]:
    place = ["metres_up", "metres_ahead", "metres_left"]
    rows: list[list[Any]] = [[*place, *(f"p_{a}" for a in ACTIONS), "needed", "blind"]]
    for at, where in _grid(arrays, "response"):
        shares = arrays["response_probabilities"][at].round(5).tolist()
        needed = ACTIONS[int(arrays["response_oracle"][at[-1]])]
        rows.append([*where, *shares, needed, int(arrays["response_blind"][at])])
    return rows


def _outcomes(arrays: dict[str, NDArray]) -> list[list[Any]]:
    rows: list[list[Any]] = [["metres_up", "metres_ahead", "metres_left", "collected"]]
    for at, where in _grid(arrays, "outcome"):
        rows.append([*where, int(arrays["outcome_collected"][at])])
    return rows


def _grid(
    arrays: dict[str, NDArray], name: str
) -> Iterator[tuple[tuple[int, ...], tuple[float, ...]]]:
    """Every index of a map with its place in metres: up, ahead, to the left."""
    axes = [arrays[f"{name}_{axis}"] for axis in ("height", "forward", "lateral")]
    for at in np.ndindex(*(len(axis) for axis in axes)):
        yield at, tuple(round(float(axis[i]), 3) for axis, i in zip(axes, at, strict=True))


def numbers(explanation: Explanation) -> dict[str, Any]:
    """Numbers behind figures, as JSON files."""
    names = (
        "verdict",
        "contradictions",
        "loops",
        "class_model",
        "attribution",
        "truth",
        "response",
        "asymmetry",
    )
    return {name: explanation.numbers[name] for name in names}


def _explained(explanation: Explanation, step: int, caption: str) -> Image.Image:
    """One step of the film."""
    arrays = explanation.arrays
    by = explanation.numbers["attribution"]["film"]["heat_by"][step]
    return pictures.explained_frame(
        arrays["film_frames"][step],
        arrays["film_heat"][step],
        arrays["film_probabilities"][step],
        int(arrays["film_actions"][step]),
        (caption, "no heat" if by is None else f"heat: {plots.NAMES[by]}"),
    )


def _probed_frame(explanation: Explanation, frame: int, caption: str) -> Image.Image:
    data = explanation.data
    plain = pictures.titled(pictures.enlarge(data["frames"][frame]), caption)
    chosen = int(data["actions"][frame])
    bars = pictures.indicator(data["probabilities"][frame], chosen, plain.width)
    return pictures.stacked([plain, bars])
