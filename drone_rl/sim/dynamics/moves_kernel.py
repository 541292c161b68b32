"""Moves for fused kernels, bit for bit those of `ComputerVision.step` and `Quadrotor.step`."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import FlightGoals, Moves
from drone_rl.sim.dynamics.flight_kernel import FlightCommand, four, make_command, run
from drone_rl.sim.dynamics.quadrotor import Quadrotor

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class Fleet:
    """Drones in flight, and the command that each move gives them."""

    command: FlightCommand
    lead: wp.float64
    climbs: bool
    is_gimballed: int
    moves: wp.array2d[wp.float64]
    """See `Moves.drifts`."""
    numbers: wp.array2d[wp.float64]
    """See `FlightState`; no rows in computer-vision mode."""


@wp.func
def is_flying(fleet: Fleet) -> bool:
    """Return whether there are drones in flight."""
    return fleet.numbers.shape[0] > 0


@wp.func
def fly_move(fleet: Fleet, world: int, action: int) -> wp.vec3d:
    """Fly a drone through a move. Returns its position, metres."""
    for axis in range(4):
        wanted = fleet.numbers[world, fs.REFERENCE + axis]
        if axis < 2 or (axis == 3 and fleet.climbs):
            place = fleet.numbers[world, fs.POSITION + wp.min(axis, 2)]
            wanted = place + wp.clamp(wanted - place, -fleet.lead, fleet.lead)
        fleet.command.goals[world, axis] = wanted
        fleet.command.drifts[world, axis] = fleet.moves[action, axis]
    run(fleet.command, fleet.numbers, fleet.numbers, world)
    numbers = fleet.numbers[world]
    return wp.vec3d(numbers[fs.POSITION], numbers[fs.POSITION + 1], numbers[fs.POSITION + 2])


LEAST = wp.constant(wp.float64(fs.LEAST))


@wp.func
def along_heading(attitude: wp.vec4d, vector: wp.vec3d) -> wp.vec3d:
    """See the function of this name in `state`."""
    w = attitude[0]
    z = attitude[3]
    square = wp.max(w * w + z * z, LEAST)
    cos = (w * w - z * z) / square
    sin = wp.float64(2.0) * w * z / square
    return wp.vec3d(cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1], vector[2])


@wp.func
def turned(attitude: wp.vec4d, turn: wp.vec2d) -> wp.vec4d:
    """See the function of this name in `state`."""
    c = turn[0]
    s = turn[1]
    return wp.vec4d(
        c * attitude[0] - s * attitude[3],
        c * attitude[1] - s * attitude[2],
        s * attitude[1] + c * attitude[2],
        s * attitude[0] + c * attitude[3],
    )


@wp.func
def camera_attitude(fleet: Fleet, world: int) -> wp.vec4:
    """Return the attitude of a drone's cameras: of its body, or `twist_about_z` on a gimbal."""
    if fleet.is_gimballed == 1:
        w = fleet.numbers[world, fs.ATTITUDE]
        z = fleet.numbers[world, fs.ATTITUDE + 3]
        length = wp.sqrt(w * w + z * z)
        if length == wp.float64(0.0):
            return wp.vec4(1.0, 0.0, 0.0, 0.0)
        return wp.vec4(float(w / length), 0.0, 0.0, float(z / length))
    return four(fleet.numbers, world, fs.ATTITUDE)


@wp.func
def is_lost(fleet: Fleet, world: int) -> bool:
    """Return whether a drone's motion has diverged."""
    return fleet.numbers[world, fs.LOST] != wp.float64(0.0)


def make_fleet(quadrotor: Quadrotor | None, numbers: Tensor) -> Fleet:
    """Return drones whose `FlightState.numbers` are given; of no rows if `quadrotor` is None."""
    fleet = Fleet()
    fleet.numbers = wp.from_torch(numbers)
    if quadrotor is not None:
        steering = quadrotor.steering
        assert isinstance(steering, Moves)
        zeros = torch.zeros(2, len(numbers), 4, dtype=torch.float64)
        goals = FlightGoals(steering.MODES, *zeros)
        fleet.command = make_command(quadrotor.frame, goals, quadrotor.settings.control_ticks)
        fleet.lead, fleet.climbs = steering.lead, steering.climbs
        fleet.is_gimballed = int(quadrotor.mount == "gimbal")
        fleet.moves = wp.from_torch(steering.drifts.contiguous())
    return fleet
