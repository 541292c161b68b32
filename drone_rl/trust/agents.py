"""Agents of evaluations: the policy and the oracle; baselines are in `policies.baselines`."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.envs.observer import with_rows
from drone_rl.envs.rollout import Act, StepContext
from drone_rl.policies import ImageNetwork, RecurrentNetwork
from drone_rl.policies.recurrent import Memory
from drone_rl.sim.tasks import Task

_NOTHING = -1.0


class PolicyAgent:
    """A policy that takes the most probable action."""

    def __init__(self, network: ImageNetwork) -> None:
        """Take a policy's network."""
        self._network = network
        self._memory: Memory | None = None

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        outputs = self._outputs(context)
        return Act(context.actions.greedy(outputs), outputs)

    def _outputs(self, context: StepContext) -> Tensor:
        """Evaluate the network, and keep a recurrent one's state of each environment."""
        network, rows = self._network, context.rows
        if not isinstance(network, RecurrentNetwork):
            return network(context.observe())
        fresh, before = network.start(len(rows)), self._memory
        memory, starts = fresh, context.starts[:, None, None]
        if before is not None and not bool(starts.all()):
            pairs = zip(fresh, before, strict=True)
            memory = Memory(*(torch.where(starts, new, old[rows]) for new, old in pairs))
        outputs, after = network.step(context.observe(), memory)
        pairs = zip(before or (None, None), after, strict=True)
        self._memory = Memory(*(with_rows(old, rows, new) for old, new in pairs))
        return outputs


class OracleAgent:
    """The task's oracle, restricted to the cubes that the camera shows.

    It reads the segmentation image of the policy's camera, with the same faults. It uses the exact
    position of each cube that is visible in at least one pixel, and nothing about the others. It
    compensates for delayed actions. A strength at which it certainly fails too often counts as
    impossible, see `possible_share` of `ShiftSettings`.
    """

    needs_only_hiding_faults = True

    def __init__(self, *, only_visible: bool = True) -> None:
        """With `only_visible=False`, the oracle uses the positions of all cubes."""
        self._only_visible = only_visible

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        worlds, rule = context.worlds, context.worlds.task.oracle
        assert rule is not None
        body = context.state.body
        for action in context.pending:
            body = worlds.dynamics.step(body, action)
        info = worlds.info(dataclasses.replace(context.state, body=body))
        if self._only_visible:
            info["next_cube"] = self._first_visible(context, info["next_cube"])
        return Act(rule.decide([info[name] for name in rule.reads], context.actions))

    def _first_visible(self, context: StepContext, next_cube: Tensor) -> Tensor:
        """Return the index of the nearest visible cube, or the number of cubes. Shape: (n, 1)."""
        props = torch.tensor([*context.worlds.scene.props, -1], device=next_cube.device)
        numbers = props[context.render("segmentation").long()].float()[:, None]
        faults, starts = context.observer.faults, context.starts
        numbers = faults(numbers, context.rows, starts, _NOTHING).flatten(1)
        count = context.worlds.task.places(context.state).shape[1]  # distractors come after
        is_cube = (numbers >= next_cube) & (numbers < count)
        visible = torch.where(is_cube, numbers, torch.full_like(numbers, count))
        return visible.amin(-1, keepdim=True).long()


def has_oracle(task: Task) -> bool:
    """Return whether a task has an oracle that can be limited to visible cubes."""
    return task.oracle is not None and "next_cube" in task.oracle.reads
