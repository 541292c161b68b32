"""What luck and knowledge achieve in the very worlds in which a policy was flown."""

from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase

from drone_rl.config import BaseTaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.evaluation.evaluator import run_episodes
from drone_rl.evaluation.metrics import Episodes
from drone_rl.evaluation.oracle import ConstantPolicy, Oracle, RandomPolicy
from drone_rl.evaluation.rule import LUCK
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import Dynamics
from drone_rl.sim.tasks import Task, as_task

BASELINES = (*LUCK, "oracle")
"""Policies that see no picture, of cube collection."""
_RANDOM_ACTIONS = 5
"""Key of the stream of random actions, derived from the first environment's."""


def make_baseline(
    name: str,
    task: BaseTaskSettings | Task[Any],
    generator: torch.Generator,
    actions: Actions | None = None,
) -> TensorDictModuleBase:
    """A policy that sees no picture.

    Args:
        name: "oracle" or one of the task's luck.
        task: The task, which the oracle knows.
        generator: Source of random actions.
        actions: What can be done; by the task's own choice of dynamics by default.

    Raises:
        InputError: The task has no oracle.
    """
    task = as_task(task)
    actions = actions or task.make_dynamics().actions
    if name == "oracle":
        return Oracle(task, actions)
    if name == "random":
        return RandomPolicy(actions, generator)
    return ConstantPolicy(actions.always(name))


def fly_baselines(
    num_worlds: int,
    task: BaseTaskSettings | Task[Any],
    worlds: dict[str, Any],
    episodes: int,
    device: str = "cpu",
    dynamics: Dynamics | None = None,
) -> dict[str, Episodes]:
    """Every baseline's episodes, the k-th of each in the same world.

    Args:
        num_worlds: Worlds in a batch, as the policy had.
        task: The task.
        worlds: `DroneEnv.state_dict` from before the policy's first episode.
        episodes: How many.
        device: Where to run.
        dynamics: How the policy's drones move; the task's own choice by default.

    Raises:
        InputError: The task has no oracle.
    """
    task = as_task(task)
    env = DroneEnv(num_worlds, task, pixels=False, device=device, dynamics=dynamics)
    actions = env.worlds.dynamics.actions
    env.load_state_dict(worlds)
    source = env.side_streams(torch.tensor([0]), _RANDOM_ACTIONS)[0]
    generator = torch.Generator(env.device).manual_seed(int(source.integers(2**63)))
    flown = {}
    for name in (*task.luck, "oracle"):
        env.load_state_dict(worlds)
        flown[name] = run_episodes(env, make_baseline(name, task, generator, actions), episodes)
    env.close()
    return flown
