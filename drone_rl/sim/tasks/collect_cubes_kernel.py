# ruff: noqa: RUF046, UP018
# pyright: reportIndexIssue=false, reportGeneralTypeIssues=false, reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false, reportReturnType=false, reportArgumentType=false
# pyright: reportCallIssue=false, reportAssignmentType=false
# (Warp compiles this file: its types are not those of Python.)
"""The rules of `collect_cubes` as Warp functions, for the fused episode kernel.

They compute the same numbers as the rules in torch, bit for bit, in double precision.
"""

import enum
from typing import Any

import torch
import warp as wp

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics import ComputerVision, Dynamics, FlightState, Quadrotor
from drone_rl.sim.dynamics.moves_kernel import (
    Fleet,
    FlyingFleet,
    camera_attitude,
    fly_move,
    is_flying,
    is_lost,
)
from drone_rl.sim.dynamics.state import LEVEL
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, Poses
from drone_rl.sim.tasks.common import HIDDEN_DEPTH


class EndReason(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    ALL_CUBES = 1
    FRONT_BOUNDARY = 2
    SIDE_BOUNDARY = 3
    STEP_LIMIT = 4
    LOST_CONTROL = 5
    """The drone's motion diverged, see `BodyState.is_lost`: precedes all other reasons."""


_RUNNING = wp.constant(int(EndReason.RUNNING))
_ALL_CUBES = wp.constant(int(EndReason.ALL_CUBES))
_FRONT_BOUNDARY = wp.constant(int(EndReason.FRONT_BOUNDARY))
_SIDE_BOUNDARY = wp.constant(int(EndReason.SIDE_BOUNDARY))
_STEP_LIMIT = wp.constant(int(EndReason.STEP_LIMIT))
_LOST_CONTROL = wp.constant(int(EndReason.LOST_CONTROL))
_DEPTH = wp.constant(wp.float64(HIDDEN_DEPTH))

STANDS = wp.constant(0)
COLLECTED = wp.constant(1)
PASSED = wp.constant(2)
"""What has become of a cube."""


@wp.struct
class Flights:
    """Worlds and what holds in all of them, see `TaskSettings`. Metres, world frame."""

    drones: wp.array[wp.vec3d]
    cubes: wp.array2d[wp.vec3d]
    fates: wp.array2d[int]
    """One of `STANDS` and so on for each cube."""
    steps: wp.array[int]
    end_reasons: wp.array[int]
    moves: wp.array[wp.vec3d]
    """One an action, in computer-vision mode."""
    fleet: Fleet
    """The drones, where they fly."""
    touch_distance: wp.float64
    front_bound: wp.float64
    side_bound: wp.float64
    step_limit: int


@wp.func
def place(flights: Flights, world: int, poses: Poses) -> None:
    """Says where the drone and the cubes are drawn; its attitude changes in flight alone.

    Args:
        flights: The worlds.
        world: Which of them.
        poses: Of as many worlds.
    """
    poses.positions[world, DRONE_FRAME] = wp.vec3(flights.drones[world])
    if is_flying(flights.fleet):
        poses.attitudes[world] = camera_attitude(flights.fleet, world)
    for cube in range(flights.cubes.shape[1]):
        at = flights.cubes[world, cube]
        if flights.fates[world, cube] != STANDS:
            at[2] = at[2] - _DEPTH
        poses.positions[world, DRONE_FRAME + 1 + cube] = wp.vec3(at)


@wp.func
def move(flights: Flights, world: int, action: int) -> float:
    """Moves a drone, as its dynamics do, and applies the rules, as `CollectCubes.judge` does.

    Args:
        flights: The worlds.
        world: Which of them.
        action: Of the drone.

    Returns:
        The reward.
    """
    drone = flights.drones[world]
    if is_flying(flights.fleet):
        drone = fly_move(flights.fleet, world, action)
    else:
        drone = drone + flights.moves[action]
    flights.drones[world] = drone
    flights.steps[world] = flights.steps[world] + 1
    reward = float(0.0)
    collected = int(0)
    for cube in range(flights.cubes.shape[1]):
        fate = flights.fates[world, cube]
        if fate == STANDS:
            fate = _fate(flights, drone, flights.cubes[world, cube])
            flights.fates[world, cube] = fate
            if fate == COLLECTED:
                reward += 1.0
        if fate == COLLECTED:
            collected += 1
    flights.end_reasons[world] = _end_reason(flights, world, drone, collected)
    return reward


@wp.func
def _fate(flights: Flights, drone: wp.vec3d, cube: wp.vec3d) -> int:
    """What becomes of a cube that stood when the drone began to move."""
    if wp.max(wp.abs(drone - cube)) <= flights.touch_distance:
        return COLLECTED
    if drone[0] > cube[0]:
        return PASSED
    return STANDS


@wp.func
def _end_reason(flights: Flights, world: int, drone: wp.vec3d, collected: int) -> int:
    """The first reason that holds, in the order of Algorithm 3; a lost drone before all."""
    if is_flying(flights.fleet):  # noqa: SIM102 (Warp evaluates both sides of "and")
        if is_lost(flights.fleet, world):
            return _LOST_CONTROL
    if collected == flights.cubes.shape[1]:
        return _ALL_CUBES
    if drone[0] > flights.front_bound:
        return _FRONT_BOUNDARY
    if wp.abs(drone[1]) > flights.side_bound:
        return _SIDE_BOUNDARY
    if flights.steps[world] >= flights.step_limit:
        return _STEP_LIMIT
    return _RUNNING


class FlyingCubes:
    """Arrays of environments, rewritten for each batch of episodes."""

    def __init__(self, settings: TaskSettings, dynamics: Dynamics, num_envs: int) -> None:
        """Allocate the arrays of at most `num_envs` environments; see `supports`."""
        cubes = settings.num_cubes
        self._drones = torch.zeros(num_envs, 3, dtype=torch.float64)
        self._cubes = torch.zeros(num_envs, cubes, 3, dtype=torch.float64)
        self._fates = torch.zeros(num_envs, cubes, dtype=torch.int32)
        self.steps = torch.zeros(num_envs, dtype=torch.int32)
        """Taken so far. Shape: (num_envs,)."""
        self.end_reasons = torch.zeros(num_envs, dtype=torch.int32)
        """Shape: (num_envs,)."""
        places = torch.zeros(num_envs, 1 + DRONE_FRAME + cubes, 3)
        attitudes = torch.tensor(LEVEL).repeat(num_envs, 1)
        self.flights, self.poses = Flights(), Poses()
        self.flights.drones = wp.from_torch(self._drones, dtype=wp.vec3d)
        self.flights.cubes = wp.from_torch(self._cubes, dtype=wp.vec3d)
        self.flights.fates = wp.from_torch(self._fates)
        self.flights.steps = wp.from_torch(self.steps)
        self.flights.end_reasons = wp.from_torch(self.end_reasons)
        if isinstance(dynamics, ComputerVision):
            self.flights.moves = wp.from_torch(dynamics.moves.contiguous(), dtype=wp.vec3d)
        self._fleet = FlyingFleet(num_envs, dynamics if isinstance(dynamics, Quadrotor) else None)
        self.flights.fleet = self._fleet.fleet
        self.flights.touch_distance = settings.touch_distance
        self.flights.front_bound = settings.front_bound
        self.flights.side_bound = settings.side_bound
        self.flights.step_limit = settings.step_limit
        self.poses.positions = wp.from_torch(places, dtype=wp.vec3)
        self.poses.attitudes = wp.from_torch(attitudes, dtype=wp.vec4)

    @staticmethod
    def supports(dynamics: Dynamics) -> bool:
        """Return whether the kernel implements these dynamics."""
        return type(dynamics) is ComputerVision or (
            type(dynamics) is Quadrotor and FlyingFleet.knows(dynamics)
        )

    def begin(self, state: Any) -> None:
        """Copy states at the start of episodes."""
        count = len(state)
        self._drones[:count] = state.drone
        self._cubes[:count] = state.cubes
        if isinstance(state.body, FlightState):
            self._fleet.begin(state.body)
        for values in (self._fates, self.steps, self.end_reasons):
            values[:count] = 0
