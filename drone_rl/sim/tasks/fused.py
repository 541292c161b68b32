"""Environments of a task of terms for the fused episode kernel."""

from typing import Any

import torch
import warp as wp

from drone_rl.sim.dynamics import ComputerVision, Dynamics, FlightState, Quadrotor
from drone_rl.sim.dynamics.control import Moves
from drone_rl.sim.dynamics.moves_kernel import make_fleet
from drone_rl.sim.dynamics.state import LEVEL, NUMBERS
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, PoseArrays
from drone_rl.sim.tasks.rules_kernel import Episodes, place
from drone_rl.utils.batch import Batch


class FusedTerms:
    """States for the fused kernel: `arrays`, `poses`, `steps` and `end_reasons`."""

    def __init__(self, task: Any, dynamics: Dynamics, state: Batch) -> None:
        """Take a task, and states as large as the batch, whose memory is used; see `supports`."""
        self.functions = (Episodes, place, task.rules.move)
        self._state, count = state, len(state)
        self.steps = torch.zeros(count, dtype=torch.int32)
        self.end_reasons = torch.zeros(count, dtype=torch.int32)
        self._drones = torch.zeros(count, 3, dtype=torch.float64)
        self._attitudes = torch.tensor(LEVEL).repeat(count, 1)
        self.arrays: Any = Episodes()
        self.arrays.world = task.world(state, self.steps, self.end_reasons)
        self.arrays.drones = wp.from_torch(self._drones, dtype=wp.vec3d)
        self.arrays.attitudes = wp.from_torch(self._attitudes, dtype=wp.vec4)
        self.arrays.steps = wp.from_torch(self.steps)
        self.arrays.end_reasons = wp.from_torch(self.end_reasons)
        actions = dynamics.actions
        speeds = actions.speeds_of(torch.arange(len(actions)))
        self.arrays.speeds = wp.from_torch(speeds, dtype=wp.vec4)
        if isinstance(dynamics, ComputerVision):
            self.arrays.moves = wp.from_torch(dynamics.moves.contiguous(), dtype=wp.vec3d)
        quadrotor = dynamics if isinstance(dynamics, Quadrotor) else None
        self._numbers = torch.zeros(count if quadrotor else 0, NUMBERS, dtype=torch.float64)
        self.arrays.fleet = make_fleet(quadrotor, self._numbers)
        self.poses: Any = PoseArrays()
        frames = torch.zeros(count, 1 + DRONE_FRAME + len(task.each), 3)
        self.poses.positions = wp.from_torch(frames, dtype=wp.vec3)
        self.poses.attitudes = wp.from_torch(self._attitudes, dtype=wp.vec4)

    @staticmethod
    def supports(dynamics: Dynamics) -> bool:
        """Return whether the kernel implements these dynamics."""
        is_flown = type(dynamics) is Quadrotor and isinstance(dynamics.steering, Moves)
        return is_flown or type(dynamics) is ComputerVision

    def begin(self, state: Any) -> None:
        """Copy states at the start of episodes."""
        count = len(state)
        for name in ("places", "present", "touched", "goal", "sides", "action", "paid"):
            getattr(self._state, name)[:count] = getattr(state, name)
        self._drones[:count] = state.drone
        self._attitudes[:count] = state.body.attitude.float()
        if isinstance(state.body, FlightState):
            self._numbers[:count] = state.body.numbers
        for values in (self.steps, self.end_reasons):
            values[:count] = 0
