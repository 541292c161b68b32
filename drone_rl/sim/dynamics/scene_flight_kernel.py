"""All ticks of a command among the solids of scenes, which replace the ground at height 0."""

import warp as wp

from drone_rl.sim.dynamics import rigid_body_kernel as rigid
from drone_rl.sim.dynamics.flight_kernel import (
    CommandedDrone,
    FlightCommand,
    among,
    finish,
    goal_of,
    grounded,
    is_near,
    loaded,
    ticked,
    touched,
)
from drone_rl.sim.scenes.solids_kernel import SolidArrays, nearest, sweep

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_FAR = wp.constant(1.0)
"""Metres from the drone's surface up to which solids are searched."""
_CORNERS = wp.constant(4)
"""Solids that push a drone back in one tick."""
_STANDS = wp.constant(0.7)
"""Upward part of a normal from which a drone stands on the solid."""
_ROUNDED = wp.constant(1e-5)
"""Metres by which a drone that a solid has stopped or pushed back may keep off it, or overlap."""


@wp.struct
class Encounter:
    """A flight after contacts, and how far the drone may go before the next one."""

    flight: CommandedDrone
    free: float


@wp.func
def encountered(
    command: FlightCommand, arrays: SolidArrays, world: int, before: CommandedDrone, was: wp.vec3
) -> Encounter:
    """Return a flight after the solids that it touches have pushed it back.

    A drone that passes its own radius in a tick stops at the first solid on its path from `was`.
    """
    frame = command.frame
    after = Encounter()
    after.flight = before
    reach = wp.float64(frame.radius + _FAR)
    least = float(0.0)
    way = before.motion.position - was
    if wp.length(way) > 0.5 * frame.radius:
        start = before.start + wp.vec3d(was)
        stop = sweep(arrays, world, start, start + wp.vec3d(way), wp.float64(frame.radius))
        if stop.fraction <= wp.float64(1.0):
            after.flight.motion.position = was + float(stop.fraction) * way
            least = -_ROUNDED
    count = int(0)
    while count < _CORNERS:
        place = before.start + wp.vec3d(after.flight.motion.position)
        found = nearest(arrays, world, place, reach)
        after.free = float(found.distance) - frame.radius
        overlap = rigid.Overlap()
        overlap.depth = -after.free
        overlap.normal = wp.vec3(found.normal)
        count += 1
        if overlap.depth > least:
            after.flight.motion = rigid.pushed_out(frame, after.flight.motion, overlap)
            if overlap.normal[2] > _STANDS:
                lift = rigid.thrust_of(frame, after.flight.rotors)
                after.flight.motion = grounded(frame, after.flight.motion, lift)
            thing = command.centers.shape[1] + found.solid
            after.flight.touch = touched(frame, after.flight, thing, overlap)
            after.free = 0.0
        else:
            count = _CORNERS
        least = _ROUNDED
    return after


@wp.func
def run_in_scene(
    command: FlightCommand,
    arrays: SolidArrays,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
    world: int,
) -> None:
    """Run all ticks of a command for one drone; see `flight_kernel.run`."""
    frame = command.frame
    flight = loaded(before, world)
    goal = goal_of(command, world, flight.start)
    near = False
    if command.centers.shape[1] > 0:
        near = is_near(command, world, flight)
    free = float(0.0)
    for tick in range(command.ticks):
        flight.tick = tick
        goal.seconds = frame.tick * float(tick)
        was = flight.motion.position
        flight = ticked(frame, goal, flight)
        if near:
            flight = among(command, world, flight)
        free = free - wp.length(flight.motion.position - was)
        if free <= 0.0:
            met = encountered(command, arrays, world, flight, was)
            flight = met.flight
            free = met.free
    finish(command, goal, flight, before, after, world)


@wp.kernel
def fly_in_scene(
    first: int,
    command: FlightCommand,
    arrays: SolidArrays,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
) -> None:
    """Run a command for drones, a thread each; `first` is the first thread's drone."""
    run_in_scene(command, arrays, before, after, first + wp.tid())
