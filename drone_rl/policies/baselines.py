"""Baselines as agents that see no images: the oracle, random actions and constant actions."""

import dataclasses
from typing import Any

import torch
from torch import Tensor

from drone_rl.envs.rollout import Act, Agent, StepContext
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import OracleRule, Task
from drone_rl.utils.errors import InputError

_NOTHING = -1.0


class OracleAgent:
    """The task's oracle: an upper bound for policies that see images.

    It compensates for delayed actions. With `only_visible` it knows the exact position of each cube
    that the segmentation image of the policy's camera, with the same faults, shows in at least one
    pixel, and nothing about the others.
    """

    needs_only_hiding_faults = True

    def __init__(self, *, only_visible: bool = False) -> None:
        self._only_visible = only_visible

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        worlds, rule = context.worlds, context.worlds.task.oracle
        body = context.state.body
        for action in context.pending:
            body = worlds.dynamics.step(body, action)
        state = dataclasses.replace(context.state, body=body)
        if not self._only_visible:
            assert rule is not None
            return Act(rule.choose(worlds, state))
        assert isinstance(rule, OracleRule)
        info = worlds.info(state)
        info["next_cube"] = self._first_visible(context, info["next_cube"])
        return Act(rule.decide([info[name] for name in rule.reads], context.actions))

    def _first_visible(self, context: StepContext, next_cube: Tensor) -> Tensor:
        """Return the index of the nearest visible cube, or the number of cubes. Shape: (n, 1)."""
        props = torch.tensor([*context.worlds.scene.props, -1], device=next_cube.device)
        numbers = props[context.render("segmentation").long()].float()[:, None]
        faults, starts = context.observer.image.faults, context.starts
        numbers = faults(numbers, context.rows, starts, _NOTHING).flatten(1)
        count = context.worlds.task.places(context.state).shape[1]  # distractors come after
        is_cube = (numbers >= next_cube) & (numbers < count)
        visible = torch.where(is_cube, numbers, torch.full_like(numbers, count))
        return visible.amin(-1, keepdim=True).long()


class RandomAgent:
    """Takes every action with the same probability."""

    def __init__(self, generator: torch.Generator) -> None:
        self._generator = generator

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        return Act(context.actions.sample((len(context.rows),), self._generator))


class ConstantAgent:
    """Always takes one action: a number, or a tensor of one environment."""

    def __init__(self, action: int | Tensor) -> None:
        self._action = torch.as_tensor(action)

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        rows, one = context.rows, self._action
        return Act(one.expand(len(rows), *one.shape).to(rows.device, copy=True))


def make_baseline(
    name: str, task: Task[Any], actions: Actions, generator: torch.Generator
) -> Agent:
    """Return a baseline of a task: "oracle" or one of its random and constant baselines.

    Args:
        name: The baseline.
        task: The task.
        actions: The action space of the drones.
        generator: Source of random actions.

    Raises:
        InputError: The task has no oracle, or the drones lack an action that the baseline needs.
    """
    if name == "random":
        return RandomAgent(generator)
    if name == "oracle":
        _check_oracle(task, actions)
        return OracleAgent()
    if (part := actions.like(name)) is None:
        raise InputError(
            f"baseline={name} of task={task.name} is no action of these drones, which have "
            f"{', '.join(actions.names)}; name some of these in Task.blind_baselines"
        )
    return ConstantAgent(actions.always(actions.names[part]))


def baseline_names(task: Task[Any], actions: Actions) -> tuple[str, ...]:
    """Return the random and constant baselines of a task, and "oracle" if these drones have one."""
    has_oracle = task.oracle is not None and task.oracle.can_fly(actions)
    return (*task.blind_baselines, "oracle") if has_oracle else task.blind_baselines


def check_baselines(task: Task[Any], actions: Actions) -> None:
    """Raise an `InputError` if these actions lack what a baseline of a task needs."""
    for name in task.blind_baselines:
        make_baseline(name, task, actions, torch.Generator())


def _check_oracle(task: Task[Any], actions: Actions) -> None:
    if task.oracle is None:
        raise InputError(
            f"task={task.name} has no oracle; choose a task that has one, or give this one "
            "a rule that knows the truth (Task.oracle)"
        )
    if not task.oracle.can_fly(actions):
        raise InputError(
            f"the oracle of task={task.name} acts by {', '.join(task.oracle.actions.names)}, these "
            f"drones by {', '.join(actions.names)}; choose dynamics that it can fly"
        )


def has_visible_oracle(task: Task[Any]) -> bool:
    """Return whether a task has an oracle that can be limited to visible cubes."""
    return task.oracle is not None and "next_cube" in task.oracle.reads
