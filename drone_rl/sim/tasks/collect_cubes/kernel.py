# ruff: noqa: RUF046, UP018
# pyright: reportIndexIssue=false
# pyright: reportReturnType=false
# pyright: reportAssignmentType=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles this file; Python's types say nothing about it, and what a loop changes is
# declared by its type.)
"""`rules` for kernels that fly whole episodes, a world at a time.

The same numbers, bit for bit: places are of double precision here, too.
"""

import warp as wp

from drone_rl.sim.dynamics.moves_kernel import Fleet, camera_attitude, fly_move, is_flying, is_lost
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, Poses
from drone_rl.sim.tasks.collect_cubes.playing import VANISHED_DEPTH
from drone_rl.sim.tasks.collect_cubes.rules import EndReason

_RUNNING = wp.constant(int(EndReason.RUNNING))
_ALL_CUBES = wp.constant(int(EndReason.ALL_CUBES))
_FRONT_BOUNDARY = wp.constant(int(EndReason.FRONT_BOUNDARY))
_SIDE_BOUNDARY = wp.constant(int(EndReason.SIDE_BOUNDARY))
_STEP_LIMIT = wp.constant(int(EndReason.STEP_LIMIT))
_LOST_CONTROL = wp.constant(int(EndReason.LOST_CONTROL))
_DEPTH = wp.constant(wp.float64(VANISHED_DEPTH))

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
    """Moves a drone, as its dynamics do, and applies the rules, as `rules.judge` does.

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
