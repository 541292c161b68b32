"""Policies that see no picture: one that knows the truth, and those that know nothing."""

from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from drone_rl.config import BaseTaskSettings
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.errors import InputError


class Oracle(TensorDictModuleBase):
    """Acts by the true positions: the best that can be hoped for."""

    def __init__(self, task: BaseTaskSettings | Task[Any], actions: Actions | None = None) -> None:
        """Learns the task's rule.

        Args:
            task: The task, or the settings of cube collection.
            actions: What it may do; the actions of the task's own choice of dynamics by default.

        Raises:
            InputError: The task has no oracle, or none that acts so.
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
        """Writes the action of each world."""
        known = [tensordict.get(key) for key in self.in_keys]
        return tensordict.set("action", self.rule.decide(known, self.actions))


class RandomPolicy(TensorDictModuleBase):
    """Draws every action with the same probability."""

    def __init__(self, actions: Actions, generator: torch.Generator) -> None:
        """Sets the source of its actions.

        Args:
            actions: What can be done.
            generator: Where they are drawn from.
        """
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.actions = actions
        self.generator = generator

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        return tensordict.set("action", self.actions.draw(tensordict.batch_size, self.generator))


class ConstantPolicy(TensorDictModuleBase):
    """Takes the same action whatever happens."""

    def __init__(self, action: int | Tensor) -> None:
        """Sets the action.

        Args:
            action: Taken at every step: a number, or of the shape and type of one world's.
        """
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.action = torch.as_tensor(action)

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        action = self.action.expand(*tensordict.batch_size, *self.action.shape)
        return tensordict.set("action", action.to(tensordict["done"].device, copy=True))
