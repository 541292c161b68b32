"""Roll out batches of scenes, search for failures, and compare episodes."""

import itertools
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import Episodes, episode_batches
from drone_rl.sim.tasks import State

_PLACEMENT = ("collected", "cube_positions")


def rollout(start: State, step: Callable[[int, State, Tensor], tuple[State, Tensor]]) -> State:
    """Step a batch of n scenes from initial states until each is over; return the final states.

    `step` is called with the number of the step, the states of the active scenes and their indices.
    It returns the next states and which of them remain active, shape (number active,), bool.
    """
    active = torch.arange(len(start), device=start.end_reason.device)
    final, state = start[active], start
    for number in itertools.count():
        state, is_active = step(number, state, active)
        final[active] = state
        if not is_active.all():
            state, active = state[is_active], active[is_active]
        if not len(active):
            break
    return final


def find_failures(
    env: EnvBase, actor: TensorDictModuleBase, num_episodes: int, enough: int
) -> tuple[NDArray[np.float64], int]:
    """Search for cube placements from which a greedy policy misses a cube.

    It runs at least `num_episodes`, in whole batches, unless `enough` failures were found before.

    Returns:
        Placements, metres to the left of the start, (failures, num_cubes); number of episodes.
    """
    found: list[NDArray[np.float64]] = []
    episodes = 0
    for batch in episode_batches(env, actor, num_episodes, keep=_PLACEMENT, is_exact=False):
        is_last = batch["next", "done"][:, 0]
        collected, cubes = (batch["next", "info", name][is_last] for name in _PLACEMENT)
        failed = cubes[~collected.all(-1)]
        found.append(np.asarray(failed[..., 1].double().cpu()))
        episodes += len(collected)
        if sum(map(len, found)) >= enough:
            break
    return np.concatenate(found), episodes


def first_difference(one: Tensor, other: Tensor) -> int | None:
    """Return the first step at which two sequences of actions differ, or None."""
    shared = min(len(one), len(other))
    steps = (one[:shared] != other[:shared]).nonzero()
    if len(steps):
        return int(steps[0, 0])
    return None if len(one) == len(other) else shared


def outcome_difference(one: Episodes, other: Episodes, i: int) -> int | None:
    """Return the length of episode i if its outcomes differ, or None."""
    is_same = bool(one.end_reason[i] == other.end_reason[i]) and torch.equal(
        one.goals.reached[i], other.goals.reached[i]
    )
    return None if is_same else int(one.length[i])


def only_index(flags: Tensor) -> int | None:
    """Return the index of the only true flag, or None if there is not exactly one."""
    places = flags.nonzero()[:, 0]
    return int(places[0]) if len(places) == 1 else None
