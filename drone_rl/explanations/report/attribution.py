"""Report section "attribution": heat maps of an episode (Figs. 13 to 15), and a film."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.evaluation.plots import images
from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.explanations.report.validation import METHOD_NAMES
from drone_rl.utils.text import Claims, Evidence

BLOCK = 16  # sides of a film are multiples of this many pixels, as its encoder requires


def _heat_by(evidence: Evidence) -> Sequence[str | None]:
    return evidence["attribution"]["film"]["heat_by"]


def say_attribution(evidence: Evidence) -> Claims:
    """Say which map is shown, and where it has no heat."""
    layer, by, claims = evidence["attribution"]["layer"], _heat_by(evidence), Claims()
    if layer is not None:
        claims["attribution.layer"] = f"Grad-CAM of layer {layer}, on the first recorded episode."
    else:
        shown = METHOD_NAMES[evidence["attribution"].get("shown", "saliency")]
        claims["attribution.no_convolution"] = (
            "Grad-CAM needs a convolution with gradients, and none is known in this policy; "
            f"{shown} is shown instead."
        )
    if "grad_cam_logit" in by:
        claims["attribution.stand_in"] = (
            f"On {list(by).count('grad_cam_logit')} of the {len(by)} steps shown, Grad-CAM of the "
            "probability is zero everywhere; Grad-CAM of the logit is shown instead."
        )
    if None in by:
        claims["attribution.no_heat"] = (
            f"On {list(by).count(None)} of the {len(by)} steps shown, the map is zero everywhere."
        )
    return claims


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
    text={"attribution": say_attribution},
    draw=lambda explanation: {"sequence": key_frames(explanation), "episode": film(explanation)},
)
