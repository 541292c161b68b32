"""Where it looks: frames of a flight with heat and indicator (Figs. 13 to 15), and the film."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.evaluation.plots import images as pictures
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.text import ATTRIBUTION
from drone_rl.explanations.report.truth_text import NAMES

BLOCK = 16
"""Pixels: what the encoder of films wants sides to be multiples of."""


def key_frames(explanation: Explanation) -> Image.Image:
    """Six frames of a flight with Grad-CAM and the indicator."""
    steps = explanation.numbers["attribution"]["film"]["key_steps"]
    tiles = [
        explained_step(explanation, entry["step"], f"{i}. {entry['why']}")
        for i, entry in enumerate(steps, start=1)
    ]
    return pictures.gridded(tiles, 3)


def film(explanation: Explanation) -> NDArray:
    """The whole flight with heat map and indicator. Shape: (T, H, W, 3), uint8."""
    steps = range(len(explanation.arrays["film_frames"]))
    frames = np.stack([np.asarray(explained_step(explanation, t, f"step {t}")) for t in steps])
    height, width = (-(-n // BLOCK) * BLOCK for n in frames.shape[1:3])
    padded = np.full((len(frames), height, width, 3), 255, np.uint8)
    padded[:, : frames.shape[1], : frames.shape[2]] = frames
    return padded


def explained_step(explanation: Explanation, step: int, caption: str) -> Image.Image:
    """One step of the film."""
    arrays = explanation.arrays
    by = explanation.numbers["attribution"]["film"]["heat_by"][step]
    return pictures.explained_frame(
        arrays["film_frames"][step],
        arrays["film_heat"][step],
        arrays["film_probabilities"][step],
        int(arrays["film_actions"][step]),
        (caption, "no heat" if by is None else f"heat: {NAMES[by]}"),
        explanation.actions,
    )


PART = Part(
    title="Where it looks (Grad-CAM)",
    label="Grad-CAM",
    place=60,
    needs=("attribution",),
    is_slow=True,
    words={"attribution": ATTRIBUTION},
    draw=lambda explanation: {"sequence": key_frames(explanation), "episode": film(explanation)},
)
