"""What luck and knowledge achieve in the very worlds in which a policy was flown."""

from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase

from drone_rl.envs import DroneEnv
from drone_rl.evaluation import ConstantPolicy, Episodes, Oracle, RandomPolicy, run_episodes
from drone_rl.sim.actions import Move
from drone_rl.sim.settings import TaskSettings
from drone_rl.utils.seeding import Stream, torch_generator
from drone_rl.verdicts.rule import LUCK

BASELINES = (*LUCK, "oracle")
"""Policies that see no picture."""
_LUCK_SEED = 0


def make_baseline(
    name: str, task: TaskSettings, generator: torch.Generator
) -> TensorDictModuleBase:
    """One of `BASELINES`.

    Args:
        name: Which.
        task: The settings that the oracle knows.
        generator: Source of random actions.
    """
    if name == "oracle":
        return Oracle(task)
    if name == "random":
        return RandomPolicy(len(Move), generator)
    return ConstantPolicy(Move[name.upper()])


def fly_baselines(
    num_worlds: int, task: TaskSettings, worlds: dict[str, Any], episodes: int, device: str = "cpu"
) -> dict[str, Episodes]:
    """Every baseline's episodes, the k-th of each in the same world.

    Args:
        num_worlds: Worlds in a batch, as the policy had.
        task: The task.
        worlds: `DroneEnv.state_dict` from before the policy's first episode.
        episodes: How many.
        device: Where to run.
    """
    env = DroneEnv(num_worlds, task, pixels=False, device=device)
    generator = torch_generator(_LUCK_SEED, Stream.ACTIONS, number=1, device=env.device)
    flown = {}
    for name in BASELINES:
        env.load_state_dict(worlds)
        flown[name] = run_episodes(env, make_baseline(name, task, generator), episodes)
    env.close()
    return flown
