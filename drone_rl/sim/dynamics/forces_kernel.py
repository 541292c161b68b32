"""What controllers, rotors and air do to drones in one tick, for whoever integrates it himself."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import Goals, Mode
from drone_rl.sim.dynamics.flight_kernel import goal_of, is_sound, is_told, loaded, write
from drone_rl.sim.dynamics.rigid_body_kernel import Airframe, axes_of, torque_of
from drone_rl.sim.dynamics.state import FlightState
from drone_rl.sim.dynamics.tick_kernel import driven, force_on
from drone_rl.sim.rendering.devices import start_warp

wp.set_module_options({"enable_backward": False})

_PLACE = wp.constant(fs.POSITION.first)
_SEED = wp.constant(fs.SEED.first)
_TICKS = wp.constant(fs.TICKS.first)
_LOST = wp.constant(fs.LOST.first)
_NUMBERS = wp.constant(fs.NUMBERS)


@wp.kernel
def push(
    frame: Airframe,
    tick: int,
    modes: wp.vec4i,
    goals: wp.array2d[wp.float64],
    drifts: wp.array2d[wp.float64],
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
    pushes: wp.array2d[wp.float64],
) -> None:
    """One tick of everything but motion and contacts, a thread for each drone.

    Args:
        frame: The drones.
        tick: Number of this one within the command.
        modes: Of the goals, one an axis.
        goals: See `Goals`.
        drifts: See `Goals`.
        before: The drones, see `FlightState.numbers`.
        after: Is written: rotors, air and the controller's memory a tick later.
        pushes: Is written: force without weight and torque, world frame, newtons and newton metres.
    """
    world = wp.tid()
    for i in range(_NUMBERS):
        after[world, i] = before[world, i]
    start = wp.vec3d(before[world, _PLACE], before[world, _PLACE + 1], before[world, _PLACE + 2])
    goal = goal_of(goals, drifts, modes, world, start)
    flight = loaded(before, world)
    lost = before[world, _LOST] != wp.float64(0.0)
    if lost or not (is_told(goal, start) and is_sound(flight.motion)):
        after[world, _LOST] = wp.float64(1.0)
        return
    axes = axes_of(flight.motion.attitude)
    ticks = wp.int64(before[world, _TICKS])
    past = ticks - wp.int64(tick)
    seed = wp.int64(before[world, _SEED])
    flight = driven(frame, modes, goal, flight, axes, seed, past, tick)
    force = force_on(frame, flight, axes)
    turning = torque_of(frame, flight.rotors)
    torque = turning[0] * axes.forward + turning[1] * axes.left + turning[2] * axes.up
    for i in range(3):
        pushes[world, i] = wp.float64(force[i])
        pushes[world, 3 + i] = wp.float64(torque[i])
    write(after, world, flight, start, ticks + wp.int64(1))


def forces(
    frame: Airframe, body: FlightState, goals: Goals, tick: int
) -> tuple[FlightState, Tensor]:
    """What moves drones in one tick, by the very controllers of `Quadrotor.fly`.

    Args:
        frame: The drones.
        body: As they are at the tick's beginning, on the CPU.
        goals: What they are told, since the command began.
        tick: Number of this one within the command: goals that drift have come so far.

    Returns:
        The drones with rotors, air and controllers a tick later, but neither moved nor touched; and
        force without weight and torque, world frame. Shape: (num_worlds, 6), float64.
    """
    start_warp("cpu")
    after = FlightState(torch.empty_like(body.numbers))
    pushes = torch.zeros(len(body), 6, dtype=torch.float64)
    arrays = [goals.values, goals.drifts, body.numbers, after.numbers, pushes]
    modes = wp.vec4i(*(int(mode) for mode in goals.modes))
    given = [wp.from_torch(array.contiguous(), return_ctype=True) for array in arrays]
    wp.launch(push, len(body), inputs=[frame, tick, modes, *given], device="cpu")
    return after, pushes


def told(body: FlightState, goals: Goals, seconds: float) -> FlightState:
    """Drones at the end of a command, which know where they are wanted; see `Quadrotor.fly`.

    Args:
        body: As they are.
        goals: What they were told.
        seconds: How long ago.
    """
    after = body.settled()
    reached = goals.values + seconds * goals.drifts
    for axis, mode in enumerate(goals.modes):
        if mode == (Mode.ANGLE if axis == 2 else Mode.POSITION):
            after.reference[:, axis] = reached[:, axis]
    return after
