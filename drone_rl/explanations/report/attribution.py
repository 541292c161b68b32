"""Report section "attribution": heat maps of an episode (Figs. 13 to 15), and a film."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.explanation import METHOD_NAMES, Explanation, Figures, Part
from drone_rl.trust.plots import images
from drone_rl.utils.text import Claims, Evidence

BLOCK = 16  # sides of a film are multiples of this many pixels, as its encoder requires


def trusted_method(evidence: Evidence) -> str | None:
    """Return the method that passed the tests of section "truth" best, if any did."""
    return evidence["truth"]["trusted"] if evidence.get("truth") else None


def say_attribution(evidence: Evidence) -> Claims:
    """Say which heat map passed the tests, or that none is to be trusted."""
    name = trusted_method(evidence)
    if name is None:
        return {
            "attribution.none_passed": (
                "No heat map of this policy has passed the tests. Do not trust the maps below."
            )
        }
    return {
        "attribution.trusted": (
            f"Shown: {METHOD_NAMES[name]}, which passed all tests of heat maps on this policy."
        )
    }


def say_untrusted(evidence: Evidence) -> Claims:
    """Say which map is shown although it is not the trusted one."""
    layer, method = evidence["attribution"]["layer"], evidence["attribution"]["shown"]
    if layer is not None:
        return {"attribution.layer": f"Grad-CAM of layer {layer}, on the first recorded episode."}
    return {
        "attribution.no_convolution": (
            "Grad-CAM needs a convolution with gradients, and none is known in this policy; "
            f"{METHOD_NAMES[method]} is shown instead."
        )
    }


def key_frames(explanation: Explanation, method: str | None) -> dict[str, Image.Image]:
    """Return up to six frames of an episode with heat map and action probabilities, by caption."""
    steps = explanation.numbers["attribution"]["film"]["key_steps"]
    tiles = {}
    for i, entry in enumerate(steps, start=1):
        caption = f"{i}. {entry['why']}"
        tiles[caption] = explained_step(explanation, entry["step"], caption, method)
    return tiles


def film(explanation: Explanation, method: str | None) -> NDArray:
    """Return the episode with heat map and action probabilities. Shape: (T, H, W, 3), uint8."""
    steps = range(len(explanation.arrays["film_frames"]))
    tiles = (explained_step(explanation, t, f"step {t}", method) for t in steps)
    frames = np.stack([np.asarray(image) for image in tiles])
    height, width = (-n % BLOCK for n in frames.shape[1:3])
    margins = (0, 0), (0, height), (0, width), (0, 0)
    return np.pad(frames, margins, constant_values=255)


def explained_step(
    explanation: Explanation, step: int, caption: str, method: str | None
) -> Image.Image:
    """Return one step of the film with the map of a trusted method, or else the default one."""
    arrays = explanation.arrays
    heat = arrays["film_heat" if method is None else f"film_heat_{method}"][step]
    by = method or explanation.numbers["attribution"]["film"]["heat_by"][step]
    mark = "" if method else ", not trusted"
    return images.explained_frame(
        arrays["film_frames"][step],
        heat,
        arrays["film_probabilities"][step],
        int(arrays["film_actions"][step]),
        (caption, f"heat: {METHOD_NAMES[by]}{mark}" if by and heat.any() else "no heat"),
        explanation.actions,
    )


def draw(explanation: Explanation) -> Figures:
    """Draw the map that passed the tests best, and the default one unless it passed, too."""
    numbers = explanation.numbers
    method, default = trusted_method(numbers), numbers["attribution"]["shown"]
    drawn: dict[str, Any] = {"sequence": key_frames(explanation, method)} if method else {}
    if not method or not numbers["truth"]["methods"][default]["trusted"]:
        drawn["untrusted"] = key_frames(explanation, None)
    return {**drawn, "episode": film(explanation, method)}


PART = Part(
    title="Heat maps",
    label="Heat maps",
    needs=("attribution",),
    text={"attribution": say_attribution, "untrusted": say_untrusted},
    draw=draw,
)
