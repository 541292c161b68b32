# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""Drones in arrays that kernels fly on their own, see `moves_kernel`."""

import torch
import warp as wp

from drone_rl.sim.dynamics.flight_state import NUMBERS, FlightState
from drone_rl.sim.dynamics.moves_kernel import Fleet
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.sim.dynamics.steering import Moves


class FlyingFleet:
    """Arrays for as many drones, written anew with each batch of episodes."""

    def __init__(self, num_worlds: int, quadrotor: Quadrotor | None) -> None:
        """Makes room.

        Args:
            num_worlds: How many there may be.
            quadrotor: What they are; none for no drones in flight.
        """
        count = num_worlds if quadrotor else 0
        self._numbers = torch.zeros(count, NUMBERS, dtype=torch.float64)
        self.fleet = fleet = Fleet()
        fleet.numbers = wp.from_torch(self._numbers)
        fleet.goals, fleet.drifts = (wp.zeros((count, 4), dtype=wp.float64) for _ in range(2))
        fleet.centers = wp.zeros((count, 0), dtype=wp.vec3d)
        if quadrotor is not None:
            steering = quadrotor.steering
            assert isinstance(steering, Moves)
            fleet.frame = quadrotor.frame
            fleet.ticks = quadrotor.settings.control_ticks
            fleet.modes = wp.vec4i(*(int(mode) for mode in steering.MODES))
            fleet.lead = steering.lead
            fleet.is_gimballed = int(quadrotor.mount == "gimbal")
            fleet.moves = wp.from_torch(steering.drifts.contiguous())

    @classmethod
    def knows(cls, quadrotor: Quadrotor) -> bool:
        """Whether kernels fly all that the drones can be told."""
        return isinstance(quadrotor.steering, Moves)

    def begin(self, state: FlightState) -> None:
        """Takes drones over at the start of episodes; the state itself stays as it is."""
        self._numbers[: len(state)] = state.numbers
