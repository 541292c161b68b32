"""Policies that see no picture: one that knows the truth, and those that know nothing."""

from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase

from drone_rl.sim.actions import Actions
from drone_rl.sim.settings import BaseTaskSettings
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
        if actions is not None and actions.names != rule.actions.names:
            raise InputError(
                f"the oracle of task={task.name} acts by {', '.join(rule.actions.names)}, these "
                f"drones by {', '.join(actions.names)}; choose dynamics that it can fly"
            )
        self.rule = rule
        keys = [("info", name) for name in rule.reads]
        self.in_keys = keys  # pyright: ignore[reportAttributeAccessIssue] (untyped in tensordict)
        self.out_keys = ["action"]

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        known = [tensordict.get(key) for key in self.in_keys]
        return tensordict.set("action", self.rule.act(*known))


class RandomPolicy(TensorDictModuleBase):
    """Draws every action with the same probability."""

    def __init__(self, num_actions: int, generator: torch.Generator) -> None:
        """Sets the source of its actions.

        Args:
            num_actions: How many there are.
            generator: Where they are drawn from.
        """
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.num_actions = num_actions
        self.generator = generator

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        shape, device = tensordict.batch_size, self.generator.device
        action = torch.randint(self.num_actions, shape, generator=self.generator, device=device)
        return tensordict.set("action", action)


class ConstantPolicy(TensorDictModuleBase):
    """Takes the same action whatever happens."""

    def __init__(self, action: int) -> None:
        """Sets the action.

        Args:
            action: Taken at every step.
        """
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.action = action

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        action = tensordict["done"][..., 0].long() * 0 + int(self.action)
        return tensordict.set("action", action)
