"""Moves in kernels: those of `ComputerVision`, and by a quadrotor as in `Quadrotor.step`."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import FlightGoals, Moves
from drone_rl.sim.dynamics.flight_kernel import FlightCommand, four, make_command, run
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.sim.rendering.devices import on_torch_stream, start_warp

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class Fleet:
    """Drones in flight, and the command that each move gives them."""

    command: FlightCommand
    lead: wp.float64
    climbs: bool
    is_gimballed: int
    moves: wp.array2d[wp.float64]
    """See `Moves.drifts`; none if actions are continuous."""
    numbers: wp.array2d[wp.float64]
    """See `FlightState`; no rows in computer-vision mode."""


@wp.func
def is_flying(fleet: Fleet) -> bool:
    """Return whether there are drones in flight."""
    return fleet.numbers.shape[0] > 0


@wp.func
def fly_move(fleet: Fleet, world: int, action: int) -> None:
    """Fly a drone through a move."""
    for axis in range(4):
        wanted = fleet.numbers[world, fs.REFERENCE + axis]
        if axis < 2 or (axis == 3 and fleet.climbs):
            place = fleet.numbers[world, fs.POSITION + wp.min(axis, 2)]
            wanted = place + wp.clamp(wanted - place, -fleet.lead, fleet.lead)
        fleet.command.goals[world, axis] = wanted
        fleet.command.drifts[world, axis] = fleet.moves[action, axis]
    run(fleet.command, fleet.numbers, fleet.numbers, world)


_LEAST = wp.constant(wp.float64(1.0e-300))
"""Least square of a length that is divided by."""


@wp.func
def along_heading(attitude: wp.vec4d, vector: wp.vec3d) -> wp.vec3d:
    """Turn a vector by the twist about z of an attitude."""
    w = attitude[0]
    z = attitude[3]
    square = wp.max(w * w + z * z, _LEAST)
    cos = (w * w - z * z) / square
    sin = wp.float64(2.0) * w * z / square
    return wp.vec3d(cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1], vector[2])


@wp.func
def turned(attitude: wp.vec4d, turn: wp.vec2d) -> wp.vec4d:
    """Return an attitude after a turn to the left about z: cosine and sine of half the angle."""
    c = turn[0]
    s = turn[1]
    return wp.vec4d(
        c * attitude[0] - s * attitude[3],
        c * attitude[1] - s * attitude[2],
        s * attitude[1] + c * attitude[2],
        s * attitude[0] + c * attitude[3],
    )


@wp.kernel
def _move_all(
    positions: wp.array[wp.vec3d],
    attitudes: wp.array[wp.vec4d],
    actions: wp.array[wp.int64],
    moves: wp.array[wp.vec3d],
    turns: wp.array[wp.vec2d],
    after: wp.array[wp.vec3d],
    turned_: wp.array[wp.vec4d],
) -> None:
    """Move drones without dynamics, a thread each."""
    i = wp.tid()
    action = int(actions[i])
    after[i] = positions[i] + along_heading(attitudes[i], moves[action])
    turned_[i] = turned(attitudes[i], turns[action])


def move_all(
    position: Tensor, attitude: Tensor, action: Tensor, moves: Tensor, turns: Tensor
) -> tuple[Tensor, Tensor]:
    """Return positions and attitudes after actions, (N,); `moves` as in `ComputerVision`."""
    device = position.device
    start_warp(str(device))
    kinds = (wp.vec3d, wp.vec4d, None, wp.vec3d, wp.vec2d, wp.vec3d, wp.vec4d)
    after = torch.empty_like(position), torch.empty_like(attitude)
    given = (position, attitude, action, moves, turns)
    inputs = [
        wp.from_torch(tensor.contiguous(), dtype=kind, return_ctype=True)
        for tensor, kind in zip((*given, *after), kinds, strict=True)
    ]
    with on_torch_stream(device):
        wp.launch(_move_all, len(position), inputs=inputs, device=str(device))
    return after


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


def make_fleet(
    quadrotor: Quadrotor | None, numbers: Tensor, obstacles: fs.Obstacles | None = None
) -> Fleet:
    """Return drones whose `FlightState.numbers` are given; of no rows if `quadrotor` is None.

    They share the memory of the obstacles' places.
    """
    fleet = Fleet()
    fleet.numbers = wp.from_torch(numbers)
    if quadrotor is not None:
        steering, ticks = quadrotor.steering, quadrotor.settings.control_ticks
        zeros = torch.zeros(2, len(numbers), 4, dtype=torch.float64)
        goals = FlightGoals(steering.modes, *zeros)
        fleet.command = make_command(quadrotor.frame, goals, ticks, obstacles)
        fleet.is_gimballed = int(quadrotor.mount == "gimbal")
        if isinstance(steering, Moves):
            fleet.lead, fleet.climbs = steering.lead, steering.climbs
            fleet.moves = wp.from_torch(steering.drifts.contiguous())
    return fleet
