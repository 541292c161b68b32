"""Report section "attribution": heat maps of an episode (Figs. 13 to 15), and a film."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.part import METHOD_NAMES, Figures, Part
from drone_rl.explanations.results import Attribution, Explanation
from drone_rl.sim.vocabulary import ShownActions
from drone_rl.trust.plots import images

BLOCK = 16  # sides of a film are multiples of this many pixels, as its encoder requires


def draw(maps: Attribution, explanation: Explanation) -> Figures:
    """Draw the map that passed the tests best, and the default one unless it passed, too."""
    actions, truth = explanation.actions, explanation.truth
    method = explanation.trusted_method

    def key_steps(method: str | None) -> dict[str, Image.Image]:
        captions = [f"{i}. {one.why}" for i, one in enumerate(maps.key_steps, start=1)]
        steps = zip(captions, maps.key_steps, strict=True)
        return {c: explained_step(maps, actions, one.step, c, method) for c, one in steps}

    drawn: dict[str, Any] = {"sequence": key_steps(method)} if method else {}
    if not (truth and method and truth.methods[maps.shown].trusted):
        drawn["untrusted"] = key_steps(None)
    steps = range(len(maps.frames))
    film = (explained_step(maps, actions, t, f"step {t}", method) for t in steps)
    return {**drawn, "episode": joined(film)}


def explained_step(
    maps: Attribution, actions: ShownActions, step: int, caption: str, method: str | None
) -> Image.Image:
    """Return one step of the film with the map of a trusted method, or else the default one."""
    by = method or maps.heat_by[step]
    heat = maps.heat[by][step] if by else np.zeros(maps.frames.shape[1:3])
    mark = "" if method else ", not trusted"
    return images.explained_frame(
        maps.frames[step],
        heat,
        maps.probabilities[step],
        int(maps.actions[step]),
        (caption, f"heat: {METHOD_NAMES[by]}{mark}" if by and heat.any() else "no heat"),
        actions,
    )


def joined(pictures: Iterable[Image.Image]) -> NDArray:
    """Return images of one size as a film. Shape: (T, H, W, 3), uint8."""
    frames = np.stack([np.asarray(picture) for picture in pictures])
    height, width = (-n % BLOCK for n in frames.shape[1:3])
    return np.pad(frames, ((0, 0), (0, height), (0, width), (0, 0)), constant_values=255)


PART = Part(title="Heat maps", label="Heat maps", draw=draw)
