"""Baselines that ignore the images: an oracle, random actions and constant actions."""

from typing import Any

import torch
from tensordict.nn import TensorDictModule
from torch import Tensor

from drone_rl.config import BaseTaskSettings
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.errors import InputError


def oracle_policy(
    task: BaseTaskSettings | Task[Any], actions: Actions | None = None
) -> TensorDictModule:
    """Return a policy that acts by the true state: an upper bound for one that sees images.

    By default its actions are the oracle's own, `OracleRule.actions`.

    Raises:
        InputError: The task has no oracle, or none for these actions.
    """
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
    available = actions or rule.actions
    return TensorDictModule(
        lambda *entries: rule.decide(entries, available),
        in_keys=[("info", name) for name in rule.reads],
        out_keys=["action"],
    )


def random_policy(actions: Actions, generator: torch.Generator) -> TensorDictModule:
    """Return a policy that samples every action with the same probability."""
    return TensorDictModule(
        lambda done: actions.sample(done.shape[:-1], generator),
        in_keys=["done"],
        out_keys=["action"],
    )


def constant_policy(action: int | Tensor) -> TensorDictModule:
    """Return a policy that always takes one action: a number, or a tensor of one environment."""
    one = torch.as_tensor(action)
    return TensorDictModule(
        lambda done: one.expand(*done.shape[:-1], *one.shape).to(done.device, copy=True),
        in_keys=["done"],
        out_keys=["action"],
    )


def make_baseline(
    name: str,
    task: BaseTaskSettings | Task[Any],
    generator: torch.Generator,
    actions: Actions | None = None,
) -> TensorDictModule:
    """Build a baseline of a task: "oracle" or one of its random and constant baselines.

    By default its actions are those of the task's default dynamics; `generator` samples random
    ones. Raises an `InputError` if the task has no oracle, or the drones have no such action.
    """
    task = as_task(task)
    actions = actions or task.make_dynamics().actions
    if name == "oracle":
        return oracle_policy(task, actions)
    if name == "random":
        return random_policy(actions, generator)
    if name not in actions.names:
        raise InputError(
            f"baseline={name} of task={task.name} is no action of these drones, which have "
            f"{', '.join(actions.names)}; name some of these in Task.blind_baselines"
        )
    return constant_policy(actions.always(name))


def check_baselines(task: Task[Any], actions: Actions) -> None:
    """Raise an `InputError` if these actions lack what a baseline or the oracle of a task needs."""
    for name in (*task.blind_baselines, "oracle"):
        make_baseline(name, task, torch.Generator(), actions)
