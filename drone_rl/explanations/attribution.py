"""Section "attribution": heat maps of one episode as a film."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.context import FILMED, Context, image, needs
from drone_rl.explanations.results import Attribution, KeyStep
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.tasks import Task

SHOWN = ("grad_cam", "grad_cam_logit")
"""Maps that are shown by default; the second one where the first has no heat."""
INSTEAD = ("saliency", "occlusion")  # without Grad-CAM, the first one that the policy allows
COUNT = 6  # key frames of an episode, as in Figs. 13 to 15.


@needs(image)
def section(context: Context) -> Attribution:
    """Compute the heat maps of the film."""
    flights, explainer, film = context.flights, context.explainer, context.film
    first = int(np.flatnonzero(flights.episode == FILMED)[0])
    inputs = film.tensor("observations"), film.tensor("actions"), film.rest
    maps = {n: context.scenes.to_frame(of(*inputs)) for n, of in explainer.methods().items()}
    methods = shown_methods(maps)
    frames = key_frames(flights, FILMED, context.scenes.task, len(film))
    return Attribution(
        layer=explainer.layer,
        shown=methods[0],
        heat_by=tuple(first_heat({name: maps[name] for name in methods})[1]),
        key_steps=tuple(KeyStep(step=frame - first, why=why) for frame, why in frames),
        frames=film.frames,
        heat={name: _normalized(of) for name, of in maps.items()},
        probabilities=film.probabilities,
        actions=film.actions,
    )


def shown_methods(methods: Collection[str]) -> list[str]:
    """Return the methods to show by default among those that a policy allows."""
    preferred = [name for name in SHOWN if name in methods]
    return preferred or [name for name in INSTEAD if name in methods][:1]


def first_heat(maps: Mapping[str, Tensor]) -> tuple[Tensor, list[str | None]]:
    """Return each step's map by the first method with heat there, and the method; else zeros.

    Shapes: (T, H, W).
    """
    heat = torch.zeros_like(next(iter(maps.values())))
    by: list[str | None] = [None] * len(heat)
    for name, of_steps in maps.items():
        for step, one in enumerate(of_steps):
            if by[step] is None and one.max() > 0:
                heat[step], by[step] = one, name
    return heat, by


def _normalized(maps: Tensor) -> NDArray:
    """Return each map divided by its maximum, as float16."""
    peak = maps.flatten(1).amax(1).clamp_min(1e-30)[:, None, None]
    return (maps / peak).numpy().astype(np.float16)


def key_frames(
    dataset: RolloutDataset, episode: int, task: Task[Any], most: int | None = None
) -> list[tuple[int, str]]:
    """Select six of the first `most` frames of an episode, fewer only if it is shorter, in order.

    Returns their numbers and reasons.

    In this order, until there are six: the first; those before a goal is reached; those before one
    is missed; the last one of an episode that failed; that half way to the first goal (or to the
    end); then those furthest from all.
    """
    frames = np.flatnonzero(dataset.episode == episode)[:most]
    reached, missed = (frames[dataset.event[frames] == event] for event in (1, -1))
    half = (frames[0] + reached[0]) // 2 if len(reached) else frames[len(frames) // 2]
    terms, end = task.vocabulary, int(dataset.end_reason[frames[-1]])
    reasons = [(frames[0], "start")]
    reasons += [(frame, f"{terms.reaches} a {terms.goal}") for frame in reached]
    reasons += [(frame, f"misses a {terms.goal}") for frame in missed]
    if end not in (0, task.success_end):
        reasons.append((frames[-1], f"fails: {task.ends(end).name.lower().replace('_', ' ')}"))
    key_steps: dict[int, str] = {}
    for frame, why in [*reasons, (half, "approach")]:
        if len(key_steps) < COUNT:
            key_steps.setdefault(int(frame), why)
    while len(key_steps) < min(COUNT, len(frames)):
        away = np.abs(frames[:, None] - np.array([*key_steps])).min(1)
        key_steps[int(frames[away.argmax()])] = "in between"
    return sorted(key_steps.items())
