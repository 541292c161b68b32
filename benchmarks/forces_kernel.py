"""Forces of controllers, rotors and air in one tick, for other integrators."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.dynamics import flight_kernel as kernel
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import FlightGoals
from drone_rl.sim.dynamics.rigid_body_kernel import AirframeNumbers, axes_of, torque_of
from drone_rl.sim.dynamics.state import FlightState
from drone_rl.sim.rendering.devices import start_warp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def push(
    command: kernel.FlightCommand,
    tick: int,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
    pushes: wp.array2d[wp.float64],
) -> None:
    """Run one tick without motion and contacts, a thread for each drone; see `forces`."""
    world = wp.tid()
    for i in range(fs.NUMBERS):
        after[world, i] = before[world, i]
    frame = command.frame
    flight = kernel.loaded(before, world)
    goal = kernel.goal_of(command, world, flight.start)
    lost = before[world, fs.LOST] != wp.float64(0.0)
    if lost or not (kernel.is_plausible(goal, flight.start) and kernel.is_sound(flight.motion)):
        after[world, fs.LOST] = wp.float64(1.0)
        return
    axes = axes_of(flight.motion.attitude)
    flight.tick = tick
    flight.past = flight.past - wp.int64(tick)
    goal.seconds = frame.tick * float(tick)
    flight = kernel.driven(frame, goal, flight, axes)
    force = kernel.force_on(frame, flight, axes)
    turning = torque_of(frame, flight.rotors)
    torque = turning[0] * axes.forward + turning[1] * axes.left + turning[2] * axes.up
    for i in range(3):
        pushes[world, i] = wp.float64(force[i])
        pushes[world, 3 + i] = wp.float64(torque[i])
    kernel.write(after, world, flight, tick + 1)


def forces(
    frame: AirframeNumbers, body: FlightState, goals: FlightGoals, tick: int
) -> tuple[FlightState, Tensor]:
    """Compute controllers, rotors and air in tick number `tick` of a command, on the CPU.

    Returns the states with rotors, air and controllers a tick later, but unchanged motion and
    contacts. Also returns the force on each drone, without its weight, then the torque, world
    frame, shape (num_envs, 6), float64.
    """
    start_warp("cpu")
    after = FlightState(torch.empty_like(body.numbers))
    pushes = torch.zeros(len(body), 6, dtype=torch.float64)
    arrays = [wp.from_torch(array) for array in (body.numbers, after.numbers, pushes)]
    inputs = [kernel.make_command(frame, goals), tick, *arrays]
    wp.launch(push, len(body), inputs=inputs, device="cpu")
    return after, pushes
