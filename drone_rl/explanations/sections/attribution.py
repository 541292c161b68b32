"""Where it looks: heat maps of all frames, and one flight as a film."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.context import FILMED, Context
from drone_rl.explanations.sequence import key_frames
from drone_rl.explanations.threads import aside

SHOWN = ("grad_cam", "grad_cam_logit")
"""Maps of the film: the second where the first has no heat at all."""
INSTEAD = ("saliency", "occlusion")
"""The first that there is, of a policy without Grad-CAM."""


@aside
def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "attribution".

    Arrays: "map_..." (T, H, W) of each method, each frame's peak 1; of the film's n steps
    "film_frames" (n, H, W, 3), "film_heat" (n, H, W), "film_probabilities" and "film_actions".
    """
    arrays = {f"map_{name}": _peak(maps) for name, maps in context.frame_maps.items()}
    flights, explainer, film = context.flights, context.explainer, context.film
    first = int(np.flatnonzero(flights.episode == FILMED)[0])
    methods = [name for name in SHOWN if name in context.maps]
    methods = methods or [name for name in INSTEAD if name in context.maps][:1]
    heat = torch.zeros(film.frames.shape[:-1])
    by: list[str | None] = [None] * len(film)
    for name in methods:
        maps = explainer.methods()[name](film.tensor("observations"), film.tensor("actions"))
        for step, one in enumerate(context.scenes.to_frame(maps)):
            if by[step] is None and one.max() > 0:
                heat[step], by[step] = one, name
    arrays |= {
        "film_frames": film.frames,
        "film_heat": _peak(heat),
        "film_probabilities": film.probabilities,
        "film_actions": film.actions,
    }
    numbers = {
        "layer": explainer.layer,
        "methods": list(context.maps),
        "shown": methods[0],
        "film": {
            "episode": FILMED,
            "heat_by": by,
            "key_steps": [
                {"step": frame - first, "why": why}
                for frame, why in key_frames(flights, FILMED, context.scenes.task)
            ],
        },
    }
    return {"attribution": numbers}, arrays


def _peak(maps: Tensor) -> NDArray:
    """Each map with its greatest value 1, as halves."""
    peak = maps.flatten(1).amax(1).clamp_min(1e-30)[:, None, None]
    return (maps / peak).numpy().astype(np.float16)
