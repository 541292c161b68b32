"""Report section "attribution": heat maps of an episode (Figs. 13 to 15), and a film."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.explanation import METHOD_NAMES, Explanation, Figures, Part
from drone_rl.trust.plots import images
from drone_rl.utils.text import Claims, Evidence

BLOCK = 16  # sides of a film are multiples of this many pixels, as its encoder requires


def _heat_by(evidence: Evidence) -> Sequence[str | None]:
    return evidence["attribution"]["film"]["heat_by"]


def trusted_method(evidence: Evidence) -> str | None:
    """Return the method that passed the tests of section "truth" best, if any did."""
    return evidence["truth"]["trusted"] if evidence.get("truth") else None


def is_shown(evidence: Evidence) -> bool:
    """Return whether a method passed the tests and its maps of the film are recorded."""
    return trusted_method(evidence) in evidence["attribution"]["film"].get("heat_of", ())


def _has_passed(evidence: Evidence, method: str) -> bool:
    """Return whether a method passed the tests, also if another one did better."""
    return bool(evidence["truth"]["methods"].get(method, {}).get("trusted"))


def say_attribution(evidence: Evidence) -> Claims:
    """Say which heat map passed the tests, or that none is to be trusted."""
    name = trusted_method(evidence)
    if name is not None and is_shown(evidence):
        return {
            "attribution.trusted": (
                f"Shown: {METHOD_NAMES[name]}, which passed all tests of heat maps on this policy."
            )
        }
    if name is not None:
        return {
            "attribution.not_recorded": (
                f"Trust {METHOD_NAMES[name]}, of which this file has no maps of the episode: run "
                "drone-rl explain again. Do not trust the maps below."
            )
        }
    if evidence.get("truth") and evidence["truth"]["methods"]:
        return {
            "attribution.none_passed": (
                "No heat map of this policy passed the tests. Do not trust the maps below."
            )
        }
    return {
        "attribution.untested": "No heat map was tested. Do not trust the maps below.",
    }


def say_untrusted(evidence: Evidence) -> Claims:
    """Say which map is shown although it is not the trusted one, and where it has no heat."""
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
            f"On {list(by).count('grad_cam_logit')} of the {len(by)} steps, Grad-CAM of the "
            "probability is zero everywhere; Grad-CAM of the logit is shown instead."
        )
    if None in by:
        claims["attribution.no_heat"] = (
            f"On {list(by).count(None)} of the {len(by)} steps, the map is zero everywhere."
        )
    return claims


def key_frames(explanation: Explanation, method: str | None) -> dict[str, Image.Image]:
    """Return up to six frames of an episode with heat map and action probabilities, by caption."""
    steps = explanation.numbers["attribution"]["film"]["key_steps"]
    captions = [f"{i}. {entry['why']}" for i, entry in enumerate(steps, start=1)]
    return {
        caption: explained_step(explanation, entry["step"], caption, method)
        for caption, entry in zip(captions, steps, strict=True)
    }


def film(explanation: Explanation, method: str | None) -> NDArray:
    """Return the episode with heat map and action probabilities. Shape: (T, H, W, 3), uint8."""
    steps = range(len(explanation.arrays["film_frames"]))
    shown = [explained_step(explanation, t, f"step {t}", method) for t in steps]
    frames = np.stack([np.asarray(one) for one in shown])
    height, width = (-(-n // BLOCK) * BLOCK for n in frames.shape[1:3])
    padded = np.full((len(frames), height, width, 3), 255, np.uint8)
    padded[:, : frames.shape[1], : frames.shape[2]] = frames
    return padded


def explained_step(
    explanation: Explanation, step: int, caption: str, method: str | None
) -> Image.Image:
    """Return one step of the film with the map of a trusted method, or else the default one."""
    arrays = explanation.arrays
    heat = arrays["film_heat" if method is None else f"film_heat_{method}"][step]
    by = method or _heat_by(explanation.numbers)[step]
    mark = "" if method else ", not trusted"
    return images.explained_frame(
        arrays["film_frames"][step],
        heat,
        arrays["film_probabilities"][step],
        int(arrays["film_actions"][step]),
        (caption, f"heat: {METHOD_NAMES[by]}{mark}" if by and heat.any() else "no heat"),
        explanation.actions,
    )


def _draw(explanation: Explanation) -> Figures:
    numbers = explanation.numbers
    method = trusted_method(numbers) if is_shown(numbers) else None
    drawn: dict[str, Any] = {"sequence": key_frames(explanation, method)} if method else {}
    default = numbers["attribution"].get("shown", "grad_cam")
    if not method or not (method == default or _has_passed(numbers, default)):
        drawn["untrusted"] = key_frames(explanation, None)
    return {**drawn, "episode": film(explanation, method)}


PART = Part(
    title="Heat maps",
    label="Heat maps",
    needs=("attribution",),
    is_slow=True,
    text={"attribution": say_attribution, "untrusted": say_untrusted},
    draw=_draw,
)
