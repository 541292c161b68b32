"""Section "importance": how far the actions depend on each input of a policy that has several.

An input is replaced by that of another episode, all others stay as they are. The placebo is the
same input, measured twice in the same states. Both differ by the input's own random errors alone,
so an input that holds nothing but random numbers has no more effect than its placebo.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.envs import Observer
from drone_rl.explanations.context import Context
from drone_rl.explanations.results import Importance, InputEffect, Median
from drone_rl.explanations.scenes import Scenes
from drone_rl.sim.tasks import State

DRAWS = 4
"""Other frames, and pairs of measurements, for each frame."""
LEVEL = 0.001
"""Probability that the lower bound of an input's excess is wrong."""
LEAST = 0.01
"""An input matters if it changes the action in one of a hundred frames, or more."""


def section(context: Context) -> Importance | None:
    """Measure the effect of each input; None if there is only one."""
    data, scenes = context.dataset, context.scenes
    if not scenes.others:
        return None
    inputs = {scenes.name: data.tensor("observations"), **data.others}
    state, seed, episode = data.state(scenes.worlds), context.seed.value, data.episode
    base = context.evaluate(inputs)
    effects = {name: np.zeros(len(data)) for name in inputs}
    placebos = {name: np.zeros(len(data)) for name in inputs}
    for draw in range(DRAWS):
        other = torch.from_numpy(other_frames(episode, np.random.default_rng([seed, draw])))
        again = [measured(scenes, state, (seed, draw, number)) for number in range(2)]
        for name, values in inputs.items():
            changed = context.evaluate({**inputs, name: values[other]})
            effects[name] += _distance(context, changed, base) / DRAWS
            one, two = (context.evaluate({**inputs, name: of[name]}) for of in again)
            placebos[name] += _distance(context, one, two) / DRAWS
    found = {name: compare(effects[name], placebos[name], episode) for name in scenes.inputs}
    return Importance(inputs=found, least=LEAST, level=LEVEL)


def compare(effect: NDArray, placebo: NDArray, episode: NDArray) -> InputEffect:
    """Compare the effect of an input in frames with that of its placebo. Shapes: (T,)."""
    excess = Median.of(effect - placebo, episode, LEVEL)
    return InputEffect(
        effect=Median.of(effect, episode, LEVEL),
        placebo=Median.of(placebo, episode, LEVEL),
        excess=excess,
        matters=(excess.lower or 0.0) > LEAST,
    )


def other_frames(episode: NDArray, rng: np.random.Generator) -> NDArray:
    """Return for each frame a random frame of another episode, if there is one. Shape: (T,)."""
    others = [np.flatnonzero(episode != one) for one in episode]
    return np.array([rng.choice(of) if len(of) else t for t, of in enumerate(others)])


def measured(scenes: Scenes, state: State, seed: tuple[int, ...]) -> dict[str, Tensor]:
    """Return the inputs in states, with fresh errors, as where episodes start. Shapes: (T, *)."""
    parts = []
    for start in range(0, len(state), scenes.worlds.num_envs):
        some = torch.arange(start, min(start + scenes.worlds.num_envs, len(state)))

        def streams(rows: Tensor, key: tuple[int, ...], start: int = start) -> list:
            return [np.random.default_rng([*seed, *key, start, row]) for row in rows.tolist()]

        observer = Observer(scenes.worlds, scenes.inputs, streams=streams)
        parts.append(observer.observe(state[some], some - start, True, None))
    return {name: torch.cat([part[name] for part in parts]) for name in scenes.inputs}


def _distance(context: Context, one: Tensor, two: Tensor) -> NDArray:
    return context.scenes.actions.distance(one, two).double().cpu().numpy()
