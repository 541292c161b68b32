"""Baselines that ignore the images: an oracle, random actions and constant actions."""

from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from drone_rl.config import BaseTaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.evaluation.metrics import Episodes
from drone_rl.evaluation.rollouts import run_episodes
from drone_rl.evaluation.rule import BLIND_BASELINES
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import Dynamics
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.errors import InputError

BASELINES = (*BLIND_BASELINES, "oracle")
"""Baselines of cube collection."""
_RANDOM_ACTIONS = 5
"""Key of the random actions' stream, derived from that of the first environment."""


class Oracle(TensorDictModuleBase):
    """Act by the true state: an upper bound for a policy that sees images."""

    def __init__(self, task: BaseTaskSettings | Task[Any], actions: Actions | None = None) -> None:
        """Take the oracle's rule from a task.

        Args:
            task: The task or its settings.
            actions: Available actions; those of the task's default dynamics by default.

        Raises:
            InputError: The task has no oracle, or none for these actions.
        """
        super().__init__()
        task = as_task(task)
        rule = task.oracle
        if rule is None:
            raise InputError(
                f"task={task.name} has no oracle; choose a task that has one, or give this one "
                "a rule that knows the truth (Task.oracle)"
            )
        if actions is not None and not rule.can_fly(actions):
            raise InputError(
                f"the oracle of task={task.name} acts by {', '.join(rule.actions.names)}, these "
                f"drones by {', '.join(actions.names)}; choose dynamics that it can fly"
            )
        self.rule, self.actions = rule, actions or rule.actions
        keys = [("info", name) for name in rule.reads]
        self.in_keys = keys  # pyright: ignore[reportAttributeAccessIssue] (untyped in tensordict)
        self.out_keys = ["action"]

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write the action of each environment."""
        known = [tensordict.get(key) for key in self.in_keys]
        return tensordict.set("action", self.rule.decide(known, self.actions))


class RandomPolicy(TensorDictModuleBase):
    """Sample every action with the same probability."""

    def __init__(self, actions: Actions, generator: torch.Generator) -> None:
        """Take the available actions and the generator that samples them."""
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.actions = actions
        self.generator = generator

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write the action of each environment."""
        return tensordict.set("action", self.actions.draw(tensordict.batch_size, self.generator))


class ConstantPolicy(TensorDictModuleBase):
    """Take the same action at every step."""

    def __init__(self, action: int | Tensor) -> None:
        """Take the action: a number, or a tensor of one environment's shape and type."""
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.action = torch.as_tensor(action)

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write the action of each environment."""
        action = self.action.expand(*tensordict.batch_size, *self.action.shape)
        return tensordict.set("action", action.to(tensordict["done"].device, copy=True))


def make_baseline(
    name: str,
    task: BaseTaskSettings | Task[Any],
    generator: torch.Generator,
    actions: Actions | None = None,
) -> TensorDictModuleBase:
    """Build a baseline of a task.

    Args:
        name: "oracle" or one of the task's random and constant baselines.
        task: The task or its settings.
        generator: Source of random actions.
        actions: Available actions; those of the task's default dynamics by default.

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


def run_baselines(
    num_worlds: int,
    task: BaseTaskSettings | Task[Any],
    worlds: dict[str, Any],
    episodes: int,
    device: str = "cpu",
    dynamics: Dynamics | None = None,
) -> dict[str, Episodes]:
    """Run the episodes of every baseline, the k-th of each from the same initial state.

    Args:
        num_worlds: Environments in a batch, as for the policy.
        task: The task or its settings.
        worlds: `DroneEnv.state_dict` from before the policy's first episode.
        episodes: How many.
        device: Where to run.
        dynamics: Vehicle dynamics; the task's default by default.

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
    for name in (*task.blind_baselines, "oracle"):
        env.load_state_dict(worlds)
        flown[name] = run_episodes(env, make_baseline(name, task, generator, actions), episodes)
    env.close()
    return flown
