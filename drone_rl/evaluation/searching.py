"""Placements of the cubes from which a policy fails, found by flying."""

import numpy as np
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector

_TOLD = ("collected", "cube_positions")


def find_failures(
    env: EnvBase, actor: TensorDictModuleBase, num_episodes: int, enough: int
) -> tuple[NDArray[np.float64], int]:
    """Flies complete episodes greedily, and notes those in which a cube is left behind.

    Args:
        env: A batch of worlds.
        actor: The policy.
        num_episodes: How many, at least: whole batches are flown.
        enough: After so many failures no further batch is flown.

    Returns:
        Where the cubes stood when it failed, metres to the left of the start, of shape (failures,
        num_cubes), and how many episodes were flown.
    """
    keep = tuple(("next", "info", name) for name in _TOLD)
    collector = EpisodeCollector(env, actor, keep=keep, keep_observations=False)
    found: list[NDArray[np.float64]] = []
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        while collector.episodes < num_episodes and sum(map(len, found)) < enough:
            batch = collector.collect()
            is_last = batch["next", "done"][:, 0]
            collected, cubes = (batch["next", "info", name][is_last] for name in _TOLD)
            failed = cubes[~collected.all(-1)]
            found.append(np.asarray(failed[..., 1].double().cpu()))
    return np.concatenate(found), collector.episodes
