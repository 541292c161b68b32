"""All ticks of a command for one drone after the other.

On a CPU a launch goes through its drones in turn, on a GPU each has a thread. Numbers are of single
precision within a command and of double precision between commands; places count from where the
command began, so that no more is lost of them in an hour than in a command.
"""

import warp as wp

from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control_kernel import ANGLE, POSITION, Goal
from drone_rl.sim.dynamics.rigid_body_kernel import Airframe, Motion, axes_of
from drone_rl.sim.dynamics.tick_kernel import NO_THING, Flight, Touch, among, is_near, ticked

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_PLACE = wp.constant(fs.POSITION.first)
_ATTITUDE = wp.constant(fs.ATTITUDE.first)
_SPEED = wp.constant(fs.VELOCITY.first)
_SPIN = wp.constant(fs.RATES.first)
_ROTORS = wp.constant(fs.ROTORS.first)
_REFERENCE = wp.constant(fs.REFERENCE.first)
_CLIMB = wp.constant(fs.CLIMB.first)
_GUST = wp.constant(fs.GUST.first)
_SEED = wp.constant(fs.SEED.first)
_TICKS = wp.constant(fs.TICKS.first)
_LOST = wp.constant(fs.LOST.first)
_THING = wp.constant(fs.THING.first)
_NORMAL = wp.constant(fs.NORMAL.first)
_POINT = wp.constant(fs.POINT.first)
_DEPTH = wp.constant(fs.DEPTH.first)
_TIME = wp.constant(fs.TIME.first)
_NUMBERS = wp.constant(fs.NUMBERS)
_FASTEST = wp.constant(1000.0)
"""Metres or radians a second beyond which a motion has diverged."""
_FARTHEST = wp.constant(1.0e18)
"""Square metres beyond which nothing is."""


@wp.func
def is_sound(motion: Motion) -> bool:
    """Whether all numbers are numbers, and none is absurd; NaN is less than nothing."""
    place = wp.length_sq(motion.position)
    speed = wp.length_sq(motion.velocity)
    spin = wp.length_sq(motion.rates)
    turn = wp.length_sq(motion.attitude)
    most = _FASTEST * _FASTEST
    near = place < most * most
    return near and speed < most and spin < most and turn > 0.5 and turn < 2.0


@wp.func
def is_told(goal: Goal, start: wp.vec3d) -> bool:
    """Whether a place and what is wanted there are numbers."""
    wanted = wp.length_sq(goal.values) + wp.length_sq(goal.drift)
    return wanted < _FARTHEST and wp.length_sq(start) < wp.float64(_FARTHEST)


@wp.func
def three(numbers: wp.array2d[wp.float64], world: int, first: int) -> wp.vec3:
    """A vector out of a drone's numbers."""
    return wp.vec3(
        float(numbers[world, first]),
        float(numbers[world, first + 1]),
        float(numbers[world, first + 2]),
    )


@wp.func
def four(numbers: wp.array2d[wp.float64], world: int, first: int) -> wp.vec4:
    """Four of a drone's numbers."""
    return wp.vec4(
        float(numbers[world, first]),
        float(numbers[world, first + 1]),
        float(numbers[world, first + 2]),
        float(numbers[world, first + 3]),
    )


@wp.func
def heading_of(motion: Motion) -> float:
    """To the left of the world's x, radians."""
    axes = axes_of(motion.attitude)
    return wp.atan2(axes.forward[1], axes.forward[0])


@wp.func
def loaded(before: wp.array2d[wp.float64], world: int) -> Flight:
    """A drone out of its numbers; its place counts from where it is."""
    flight = Flight()
    flight.motion = Motion()
    flight.motion.attitude = four(before, world, _ATTITUDE)
    flight.motion.velocity = three(before, world, _SPEED)
    flight.motion.rates = three(before, world, _SPIN)
    flight.rotors = four(before, world, _ROTORS)
    flight.climb = float(before[world, _CLIMB])
    flight.gust = three(before, world, _GUST)
    flight.touch = Touch()
    flight.touch.thing = NO_THING
    return flight


@wp.func
def goal_of(
    goals: wp.array2d[wp.float64],
    drifts: wp.array2d[wp.float64],
    modes: wp.vec4i,
    world: int,
    start: wp.vec3d,
) -> Goal:
    """What a drone is told; places count from where it is."""
    goal = Goal()
    for axis in range(4):
        value = goals[world, axis]
        if modes[axis] == POSITION:
            value = value - start[wp.min(axis, 2)]
        goal.values[axis] = float(value)
        goal.drift[axis] = float(drifts[world, axis])
    return goal


@wp.func
def write_touch(
    after: wp.array2d[wp.float64], world: int, touch: Touch, start: wp.vec3d, seconds: wp.float64
) -> None:
    """Records a contact; `seconds` is when, in the episode."""
    after[world, _THING] = wp.float64(touch.thing)
    for i in range(3):
        after[world, _NORMAL + i] = wp.float64(touch.normal[i])
        after[world, _POINT + i] = start[i] + wp.float64(touch.point[i])
    after[world, _DEPTH] = wp.float64(touch.depth)
    after[world, _TIME] = seconds


@wp.func
def write_reference(
    after: wp.array2d[wp.float64],
    goals: wp.array2d[wp.float64],
    drifts: wp.array2d[wp.float64],
    modes: wp.vec4i,
    world: int,
    seconds: wp.float64,
) -> None:
    """Records where a drone is wanted: where it is, of axes on which nothing was wanted."""
    for axis in range(4):
        reference = goals[world, axis] + seconds * drifts[world, axis]
        if axis == 2:
            if modes[2] != ANGLE:
                axes = axes_of(four(after, world, _ATTITUDE))
                reference = wp.float64(wp.atan2(axes.forward[1], axes.forward[0]))
        elif modes[axis] != POSITION:
            reference = after[world, _PLACE + wp.min(axis, 2)]
        after[world, _REFERENCE + axis] = reference


@wp.func
def write(
    after: wp.array2d[wp.float64], world: int, flight: Flight, start: wp.vec3d, past: wp.int64
) -> None:
    """A drone's numbers at the end of a command; `past` counts the episode's ticks till then."""
    motion = flight.motion
    for i in range(3):
        after[world, _PLACE + i] = start[i] + wp.float64(motion.position[i])
        after[world, _SPEED + i] = wp.float64(motion.velocity[i])
        after[world, _SPIN + i] = wp.float64(motion.rates[i])
        after[world, _GUST + i] = wp.float64(flight.gust[i])
    for i in range(4):
        after[world, _ATTITUDE + i] = wp.float64(motion.attitude[i])
        after[world, _ROTORS + i] = wp.float64(flight.rotors[i])
    after[world, _CLIMB] = wp.float64(flight.climb)
    after[world, _TICKS] = wp.float64(past)


@wp.func
def command(
    frame: Airframe,
    ticks: int,
    modes: wp.vec4i,
    goals: wp.array2d[wp.float64],
    drifts: wp.array2d[wp.float64],
    centers: wp.array2d[wp.vec3d],
    half_sizes: wp.vec3,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
    world: int,
) -> None:
    """Flies a drone through all ticks of a command.

    Args:
        frame: What it is.
        ticks: How many.
        modes: Of the goals, one an axis.
        goals: See `Goals`.
        drifts: See `Goals`.
        centers: Of the obstacles of each drone's world, metres.
        half_sizes: Of every obstacle, metres.
        before: The drones, see `FlightState.numbers`.
        after: Is written; may be the same.
        world: Which of the drones.
    """
    start = wp.vec3d(before[world, _PLACE], before[world, _PLACE + 1], before[world, _PLACE + 2])
    seed = wp.int64(before[world, _SEED])
    past = wp.int64(before[world, _TICKS])
    height = float(start[2])
    goal = goal_of(goals, drifts, modes, world, start)
    flight = loaded(before, world)
    lost = before[world, _LOST] != wp.float64(0.0) or not is_told(goal, start)
    near = False
    if centers.shape[1] > 0:
        seconds = frame.tick * float(ticks)
        near = is_near(frame, flight, start, centers[world], half_sizes, seconds)
    for tick in range(ticks):
        flight = ticked(frame, modes, goal, flight, height, seed, past, tick)
        if near:
            flight = among(frame, flight, start, centers[world], half_sizes, tick)
    for i in range(_NUMBERS):
        after[world, i] = before[world, i]
    if lost or not is_sound(flight.motion):
        after[world, _LOST] = wp.float64(1.0)
        for i in range(_SPEED, _SPIN + 3):
            after[world, i] = wp.float64(0.0)
        return
    length = wp.float64(frame.tick)
    write(after, world, flight, start, past + wp.int64(ticks))
    write_reference(after, goals, drifts, modes, world, length * wp.float64(ticks))
    if flight.touch.thing != NO_THING:
        when = length * wp.float64(past + wp.int64(flight.touch.tick + 1))
        write_touch(after, world, flight.touch, start, when)


@wp.kernel
def fly(
    first: int,
    frame: Airframe,
    ticks: int,
    modes: wp.vec4i,
    goals: wp.array2d[wp.float64],
    drifts: wp.array2d[wp.float64],
    centers: wp.array2d[wp.vec3d],
    half_sizes: wp.vec3,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
) -> None:
    """Flies drones, a thread each; `first` is that of the first thread. See `command`."""
    world = first + wp.tid()
    command(frame, ticks, modes, goals, drifts, centers, half_sizes, before, after, world)
