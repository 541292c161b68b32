# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""Worlds of cube collection in arrays that kernels fly on their own, see `kernel`."""

from typing import Self

import torch
import warp as wp

from drone_rl.sim.dynamics import ComputerVision, Dynamics, FlightState, Quadrotor
from drone_rl.sim.dynamics.body import LEVEL
from drone_rl.sim.dynamics.fleet import FlyingFleet
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, Poses
from drone_rl.sim.tasks.collect_cubes.kernel import Flights
from drone_rl.sim.tasks.collect_cubes.practice import Practice
from drone_rl.sim.tasks.collect_cubes.rules import WorldState
from drone_rl.sim.tasks.collect_cubes.task import CollectCubes
from drone_rl.sim.tasks.playable import Playable


class FlyingCubes:
    """Arrays for as many worlds, written anew with each batch of episodes."""

    def __init__(
        self, task: CollectCubes, dynamics: ComputerVision | Quadrotor, num_worlds: int
    ) -> None:
        """Makes room.

        Args:
            task: Whose rules hold.
            dynamics: How drones move.
            num_worlds: How many there may be.
        """
        settings = task.settings
        cubes = settings.num_cubes
        self._drones = torch.zeros(num_worlds, 3, dtype=torch.float64)
        self._cubes = torch.zeros(num_worlds, cubes, 3, dtype=torch.float64)
        self._fates = torch.zeros(num_worlds, cubes, dtype=torch.int32)
        self.steps = torch.zeros(num_worlds, dtype=torch.int32)
        """Taken so far. Shape: (num_worlds,)."""
        self.end_reasons = torch.zeros(num_worlds, dtype=torch.int32)
        """Shape: (num_worlds,)."""
        places = torch.zeros(num_worlds, 1 + DRONE_FRAME + cubes, 3)
        attitudes = torch.tensor(LEVEL).repeat(num_worlds, 1)
        self.flights, self.poses = Flights(), Poses()
        self.flights.drones = wp.from_torch(self._drones, dtype=wp.vec3d)
        self.flights.cubes = wp.from_torch(self._cubes, dtype=wp.vec3d)
        self.flights.fates = wp.from_torch(self._fates)
        self.flights.steps = wp.from_torch(self.steps)
        self.flights.end_reasons = wp.from_torch(self.end_reasons)
        if isinstance(dynamics, ComputerVision):
            self.flights.moves = wp.from_torch(dynamics.moves.contiguous(), dtype=wp.vec3d)
        self._fleet = FlyingFleet(num_worlds, dynamics if isinstance(dynamics, Quadrotor) else None)
        self.flights.fleet = self._fleet.fleet
        self.flights.touch_distance = settings.touch_distance
        self.flights.front_bound = settings.front_bound
        self.flights.side_bound = settings.side_bound
        self.flights.step_limit = settings.step_limit
        self.poses.positions = wp.from_torch(places, dtype=wp.vec3)
        self.poses.attitudes = wp.from_torch(attitudes, dtype=wp.vec4)

    @classmethod
    def find(cls, task: Playable, dynamics: Dynamics, num_worlds: int) -> Self | None:
        """The same, if these are rules and moves that the kernel knows."""
        if type(task) not in (CollectCubes, Practice):
            return None
        if type(dynamics) is ComputerVision or (
            type(dynamics) is Quadrotor and FlyingFleet.knows(dynamics)
        ):
            return cls(task, dynamics, num_worlds)
        return None

    def begin(self, state: WorldState) -> None:
        """Takes worlds over at the start of episodes; the state itself stays as it is."""
        count = len(state)
        self._drones[:count] = state.drone
        self._cubes[:count] = state.cubes
        if isinstance(state.body, FlightState):
            self._fleet.begin(state.body)
        for values in (self._fates, self.steps, self.end_reasons):
            values[:count] = 0
