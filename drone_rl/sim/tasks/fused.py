"""Environments of tasks of objects for the fused episode kernel."""

from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.dynamics import ComputerVision, Dynamics, FlightState, Quadrotor
from drone_rl.sim.dynamics.control import Moves
from drone_rl.sim.dynamics.moves_kernel import make_fleet
from drone_rl.sim.dynamics.state import NUMBERS
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, PoseArrays
from drone_rl.sim.tasks.geometry_kernel import OBSTACLE
from drone_rl.sim.tasks.objects import ObjectTask, follows_rules
from drone_rl.sim.tasks.rules_kernel import Episodes, place
from drone_rl.sim.tasks.task import State, Task


def fused_rules(task: Task[Any], dynamics: Dynamics, state: State) -> "FusedObjects | None":
    """Return environments as many as states for the fused kernel, or None if it lacks the rules."""
    if not isinstance(task, ObjectTask) or not follows_rules(task):
        return None
    is_flown = type(dynamics) is Quadrotor and isinstance(dynamics.steering, Moves)
    if type(dynamics) is not ComputerVision and (
        not is_flown or bool((task.roles == OBSTACLE).any())
    ):
        return None
    return FusedObjects(task, dynamics, state)


class FusedObjects:
    """States for the fused kernel: `arrays`, `poses`, `steps` and `end_reasons`."""

    def __init__(self, task: ObjectTask, dynamics: Dynamics, state: State) -> None:
        """Allocate the arrays of as many environments as states; see `fused_rules`."""
        self._rules = task.rules
        self.functions = (Episodes, place, task.rules.compiled.move)
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
        actions = dynamics.actions
        speeds = actions.speeds_of(torch.arange(len(actions)))
        self.arrays.speeds = wp.from_torch(speeds, dtype=wp.vec4)
        if isinstance(dynamics, ComputerVision):
            self.arrays.moves = wp.from_torch(dynamics.moves.contiguous(), dtype=wp.vec3d)
            self.arrays.turns = wp.from_torch(dynamics.turns, dtype=wp.vec2d)
        quadrotor = dynamics if isinstance(dynamics, Quadrotor) else None
        self._numbers = torch.zeros(count if quadrotor else 0, NUMBERS, dtype=torch.float64)
        self.arrays.fleet = make_fleet(quadrotor, self._numbers)
        self.poses: Any = PoseArrays()
        frames = torch.zeros(count, 1 + DRONE_FRAME + len(task.objects), 3)
        self.poses.positions = wp.from_torch(frames, dtype=wp.vec3)
        self.poses.attitudes = wp.zeros(count, dtype=wp.vec4, device="cpu")

    def paid(self, count: int) -> Tensor:
        """Return the sum of each reward term in the first episodes. Shape: (count, R), float32.

        Raises:
            InputError: A term is not finite.
        """
        sums = self._state.paid[:count]
        self._rules.check(sums)
        return sums.float()

    def begin(self, state: Any) -> None:
        """Copy states at the start of episodes."""
        count = len(state)
        for name, values in vars(self._state).items():
            if name not in ("body", "steps", "end_reason"):
                values[:count] = getattr(state, name)
        self._drones[:count] = state.drone
        self._attitudes[:count] = state.body.attitude
        if isinstance(state.body, FlightState):
            self._numbers[:count] = state.body.numbers
        for values in (self.steps, self.end_reasons):
            values[:count] = 0
