"""Report section "attribution": heat maps of an episode (Figs. 13 to 15), and a film."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.evaluation.plots import images
from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.explanations.report.validation import METHOD_NAMES
from drone_rl.utils.text import Evidence, Sentence

BLOCK = 16
"""Sides of a film are multiples of this many pixels, as its encoder requires."""


def _heat_by(evidence: Evidence) -> Sequence[str | None]:
    return evidence["attribution"]["film"]["heat_by"]


def _count(evidence: Evidence, method: str | None) -> str:
    by = _heat_by(evidence)
    return f"On {list(by).count(method)} of the {len(by)} steps shown"


ATTRIBUTION = (
    Sentence(
        "attribution.layer",
        "the policy has a convolution",
        lambda e: e["attribution"]["layer"] is not None,
        lambda e: f"Grad-CAM of layer {e['attribution']['layer']}, on the first recorded episode.",
    ),
    Sentence(
        "attribution.no_convolution",
        "no convolution is known",
        lambda e: e["attribution"]["layer"] is None,
        lambda e: (
            "Grad-CAM needs a convolution with gradients, and none is known in this policy; "
            f"{METHOD_NAMES[e['attribution'].get('shown', 'saliency')]} is shown instead."
        ),
    ),
    Sentence(
        "attribution.stand_in",
        "some steps show Grad-CAM of the logit",
        lambda e: "grad_cam_logit" in _heat_by(e),
        lambda e: (
            f"{_count(e, 'grad_cam_logit')}, Grad-CAM of the probability is zero everywhere; "
            "Grad-CAM of the logit is shown instead."
        ),
    ),
    Sentence(
        "attribution.no_heat",
        "some steps have a map of zeros",
        lambda e: None in _heat_by(e),
        lambda e: f"{_count(e, None)}, the map is zero everywhere.",
    ),
)


def key_frames(explanation: Explanation) -> Image.Image:
    """Return six frames of an episode with heat map and action probabilities."""
    steps = explanation.numbers["attribution"]["film"]["key_steps"]
    tiles = [
        explained_step(explanation, entry["step"], f"{i}. {entry['why']}")
        for i, entry in enumerate(steps, start=1)
    ]
    return images.gridded(tiles, 3)


def film(explanation: Explanation) -> NDArray:
    """Return the episode with heat map and action probabilities. Shape: (T, H, W, 3), uint8."""
    steps = range(len(explanation.arrays["film_frames"]))
    frames = np.stack([np.asarray(explained_step(explanation, t, f"step {t}")) for t in steps])
    height, width = (-(-n // BLOCK) * BLOCK for n in frames.shape[1:3])
    padded = np.full((len(frames), height, width, 3), 255, np.uint8)
    padded[:, : frames.shape[1], : frames.shape[2]] = frames
    return padded


def explained_step(explanation: Explanation, step: int, caption: str) -> Image.Image:
    """Return one step of the film."""
    arrays = explanation.arrays
    by = _heat_by(explanation.numbers)[step]
    return images.explained_frame(
        arrays["film_frames"][step],
        arrays["film_heat"][step],
        arrays["film_probabilities"][step],
        int(arrays["film_actions"][step]),
        (caption, "no heat" if by is None else f"heat: {METHOD_NAMES[by]}"),
        explanation.actions,
    )


PART = Part(
    title="Heat maps (Grad-CAM)",
    label="Grad-CAM",
    needs=("attribution",),
    is_slow=True,
    text={"attribution": ATTRIBUTION},
    draw=lambda explanation: {"sequence": key_frames(explanation), "episode": film(explanation)},
)
