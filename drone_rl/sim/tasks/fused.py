"""Environments of tasks of objects for the fused episode kernel."""

import dataclasses
from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics import (
    BodyState,
    ComputerVision,
    Dynamics,
    FlightState,
    Kinematic,
    Quadrotor,
)
from drone_rl.sim.dynamics.moves_kernel import make_fleet
from drone_rl.sim.dynamics.state import NUMBERS
from drone_rl.sim.dynamics.velocity_kernel import make_rates
from drone_rl.sim.tasks.objects import ObjectTask, follows_rules
from drone_rl.sim.tasks.rules_kernel import Episodes, place
from drone_rl.sim.tasks.task import State, Task


def fused_rules(task: Task[Any], dynamics: Dynamics, state: State) -> "FusedObjects | str":
    """Return environments as many as states for the fused kernel, or why it lacks the rules."""
    is_known = type(dynamics) in (ComputerVision, Kinematic, Quadrotor)
    if not isinstance(task, ObjectTask) or not follows_rules(task) or not is_known:
        return f"task {type(task).__name__} with {type(dynamics).__name__} is not fused"
    if task.scenes:
        return "not fused: the task takes place in a scene file"
    if in_torch := [term.name for term, _ in task.rules.compiled.in_torch]:
        return f"not fused: term {', '.join(in_torch)} is in torch"
    if isinstance(dynamics, Quadrotor) and any(
        of.event and of.role == "obstacle" for of in task.each
    ):
        return "flight among obstacles that events move is not fused"
    return FusedObjects(task, dynamics, state)


_COUNTED = ("body", "steps", "end_reason")
"""Fields of states that have arrays of their own."""


class FusedObjects:
    """States for the fused kernel: `arrays`, `steps` and `end_reasons`."""

    def __init__(self, task: ObjectTask, dynamics: Dynamics, state: State) -> None:
        """Allocate the arrays of as many environments as states; see `fused_rules`."""
        self._task: Any = task
        self._rules, actions = task.rules, dynamics.actions
        compiled, rates = task.rules.compiled, isinstance(actions, ContinuousActions)
        self.functions = (Episodes, place, compiled.steer if rates else compiled.move)
        """Warp structure of the states; functions that write poses and that step an environment."""
        self._state: Any = state[torch.arange(len(state))]
        count = len(state)
        self.steps = torch.zeros(count, dtype=torch.int32)
        self.end_reasons = torch.zeros(count, dtype=torch.int32)
        self._drones = torch.zeros(count, 3, dtype=torch.float64)
        self._attitudes = torch.zeros(count, 4, dtype=torch.float64)
        self.arrays: Any = Episodes()
        self.arrays.world = task.rules.world(self._state, self.steps, self.end_reasons, dynamics)
        self.arrays.drones = wp.from_torch(self._drones, dtype=wp.vec3d)
        self.arrays.attitudes = wp.from_torch(self._attitudes, dtype=wp.vec4d)
        self.arrays.steps = wp.from_torch(self.steps)
        self.arrays.end_reasons = wp.from_torch(self.end_reasons)
        if isinstance(actions, ContinuousActions):
            self.arrays.rates = make_rates(actions)
            self.arrays.seconds = dynamics.timestep
        else:
            speeds = actions.speeds_of(torch.arange(len(actions)))
            self.arrays.speeds = wp.from_torch(speeds, dtype=wp.vec4)
        if isinstance(dynamics, ComputerVision):
            self.arrays.moves = wp.from_torch(dynamics.moves.contiguous(), dtype=wp.vec3d)
            self.arrays.turns = wp.from_torch(dynamics.turns, dtype=wp.vec2d)
        quadrotor = dynamics if isinstance(dynamics, Quadrotor) else None
        self._numbers = torch.zeros(count if quadrotor else 0, NUMBERS, dtype=torch.float64)
        self._centers = torch.empty(0)
        solid = self._task.obstacles(state)
        if solid is not None:
            self._centers = solid.centers.clone(memory_format=torch.contiguous_format)
            solid = dataclasses.replace(solid, centers=self._centers)
        self.arrays.fleet = make_fleet(quadrotor, self._numbers, solid)

    def paid(self, count: int) -> Tensor:
        """Return the sum of each reward term in the first episodes. Shape: (count, R), float32.

        Raises:
            InputError: A term or an event is not finite.
        """
        state = self._state[:count]
        self._rules.check(state)
        return state.paid.float()

    def begin(self, state: Any, rows: Tensor | None = None) -> None:
        """Copy states of running episodes to environments, (k,), by default the first."""
        where = slice(len(state)) if rows is None else rows
        for name, values in vars(self._state).items():
            if name not in _COUNTED:
                values[where] = getattr(state, name)
        self._drones[where] = state.drone
        self._attitudes[where] = state.body.attitude
        if isinstance(state.body, FlightState):
            self._numbers[where] = state.body.numbers
        if len(self._centers):  # which rules leave where they are
            self._centers[where] = self._task.obstacles(state).centers
        self.steps[where] = state.steps.int()
        self.end_reasons[where] = 0

    def current(self) -> Any:
        """Return the states of all environments; those of drones that don't fly have no speed."""
        numbers, fields = self._numbers.clone(), vars(self._state)
        body = (
            FlightState(numbers)
            if len(numbers)
            else BodyState.at_rest(self._drones.clone(), self._attitudes.clone())
        )
        counts = {"steps": self.steps.long(), "end_reason": self.end_reasons.long()}
        kept = {name: values.clone() for name, values in fields.items() if name not in _COUNTED}
        return dataclasses.replace(self._state, body=body, **counts, **kept)
