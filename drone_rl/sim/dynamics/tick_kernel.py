"""One tick of a flight: controllers, rotors, air, motion, contacts."""

import warp as wp

from drone_rl.sim.dynamics import control_kernel, state
from drone_rl.sim.dynamics.control_kernel import climb_memory
from drone_rl.sim.dynamics.rigid_body_kernel import (
    Airframe,
    Axes,
    Motion,
    Overlap,
    advanced,
    answered,
    axes_of,
    box_overlap,
    drag_of,
    gust_after,
    pushed_out,
    thrust_of,
    torque_of,
)

wp.set_module_options({"enable_backward": False})

NO_THING = wp.constant(state.NOTHING)
GROUND = wp.constant(state.GROUND)
_WILDEST = wp.constant(10.0)
"""Standard deviations that no gust is beyond."""


@wp.struct
class Touch:
    """The last contact of a command."""

    thing: int
    normal: wp.vec3
    point: wp.vec3
    depth: float
    tick: int


@wp.struct
class Flight:
    """All that changes in a flight."""

    motion: Motion
    rotors: wp.vec4
    climb: float
    gust: wp.vec3
    touch: Touch


@wp.func
def driven(
    frame: Airframe,
    modes: wp.vec4i,
    goal: control_kernel.Goal,
    before: Flight,
    axes: Axes,
    seed: wp.int64,
    past: wp.int64,
    tick: int,
) -> Flight:
    """A flight whose controllers, rotors and air are a tick later; it has not moved yet.

    Args:
        frame: The drone.
        modes: Of the goals, one an axis.
        goal: What it is told.
        before: The flight.
        axes: The body's.
        seed: Of the episode's gusts.
        past: Ticks of the episode before the command.
        tick: Number of this one within the command.
    """
    flight = before
    motion = before.motion
    seconds = frame.tick * float(tick)
    asked = control_kernel.rotors_wanted(frame, modes, goal, seconds, motion, axes, before.climb)
    if modes[3] == control_kernel.VELOCITY or modes[3] == control_kernel.POSITION:
        missing = control_kernel.climb_missing(frame, modes, goal, seconds, motion)
        flight.climb = climb_memory(frame, missing, before.climb)
    flight.rotors = answered(frame, before.rotors, asked)
    if frame.gusts > 0.0:
        speed = wp.length(motion.velocity - frame.wind)
        flight.gust = gust_after(frame, before.gust, speed, seed, past + wp.int64(tick))
    return flight


@wp.func
def force_on(frame: Airframe, flight: Flight, axes: Axes) -> wp.vec3:
    """What rotors and air do to a drone, newtons, world frame; weight is left out."""
    through = flight.motion.velocity - frame.wind - flight.gust
    return thrust_of(frame, flight.rotors) * axes.up + drag_of(frame, axes, through)


@wp.func
def ticked(
    frame: Airframe,
    modes: wp.vec4i,
    goal: control_kernel.Goal,
    before: Flight,
    height: float,
    seed: wp.int64,
    past: wp.int64,
    tick: int,
) -> Flight:
    """A flight a tick later, over bare ground.

    Args:
        frame: The drone.
        modes: Of the goals, one an axis.
        goal: What it is told.
        before: The flight.
        height: At which the command began, metres.
        seed: Of the episode's gusts.
        past: Ticks of the episode before the command.
        tick: Number of this one within the command.
    """
    axes = axes_of(before.motion.attitude)
    flight = driven(frame, modes, goal, before, axes, seed, past, tick)
    lift = thrust_of(frame, flight.rotors)
    force = force_on(frame, flight, axes)
    flight.motion = advanced(frame, before.motion, force, torque_of(frame, flight.rotors))
    overlap = Overlap()
    overlap.normal = wp.vec3(0.0, 0.0, 1.0)
    overlap.depth = frame.radius - (height + flight.motion.position[2])
    if overlap.depth >= 0.0:
        flight.motion = grounded(frame, pushed_out(frame, flight.motion, overlap), lift)
        flight.touch = touched(frame, before.touch, GROUND, flight.motion, overlap, tick)
    return flight


@wp.func
def among(
    frame: Airframe,
    before: Flight,
    start: wp.vec3d,
    centers: wp.array[wp.vec3d],
    half_sizes: wp.vec3,
    tick: int,
) -> Flight:
    """A flight after what it touches has pushed it back.

    Args:
        frame: The drone.
        before: The flight.
        start: Where the command began, metres.
        centers: Of the obstacles, metres.
        half_sizes: Of each, metres.
        tick: Number of the tick within the command.
    """
    flight = before
    for thing in range(centers.shape[0]):
        center = flight.motion.position + wp.vec3(start - centers[thing])
        overlap = box_overlap(center, frame.radius, half_sizes)
        if overlap.depth > 0.0:
            flight.motion = pushed_out(frame, flight.motion, overlap)
            flight.touch = touched(frame, flight.touch, thing, flight.motion, overlap, tick)
    return flight


@wp.func
def is_near(
    frame: Airframe,
    flight: Flight,
    start: wp.vec3d,
    centers: wp.array[wp.vec3d],
    half_sizes: wp.vec3,
    seconds: float,
) -> bool:
    """Whether any obstacle may be touched within so many seconds, see `among`.

    Rotors and weight gain no more speed than without air, and air no more than its own twice over.
    """
    air = wp.length(frame.wind) + wp.length(flight.gust) + _WILDEST * frame.gusts
    gain = frame.per_mass * (4.0 * frame.rotor_thrust + frame.weight) * seconds
    fastest = wp.length(flight.motion.velocity) + 2.0 * air + gain
    near = int(0)
    for thing in range(centers.shape[0]):
        center = wp.vec3(start - centers[thing])
        away = box_overlap(center, frame.radius + fastest * seconds, half_sizes)
        if away.depth > 0.0:
            near = 1
    return near == 1


@wp.func
def grounded(frame: Airframe, motion: Motion, lift: float) -> Motion:
    """The motion of a drone on the ground: one whose rotors can't carry it stands level."""
    after = motion
    if lift < frame.weight:
        w = motion.attitude[0]
        z = motion.attitude[3]
        length = wp.sqrt(wp.max(w * w + z * z, 1.0e-12))
        after.attitude = wp.vec4(w / length, 0.0, 0.0, z / length)
        after.rates = wp.vec3(0.0, 0.0, 0.0)
    return after


@wp.func
def touched(
    frame: Airframe, before: Touch, thing: int, motion: Motion, overlap: Overlap, tick: int
) -> Touch:
    """What is recorded of a contact: obstacles count more than the ground, later ones than earlier.

    Args:
        frame: The drone.
        before: The last one.
        thing: Number of what is touched now.
        motion: Of the drone, already pushed out.
        overlap: Before that.
        tick: When.
    """
    if before.thing >= 0 and thing < 0:
        return before
    now = Touch()
    now.thing = thing
    now.normal = overlap.normal
    now.depth = overlap.depth
    now.point = motion.position - frame.radius * overlap.normal
    now.tick = tick
    return now
