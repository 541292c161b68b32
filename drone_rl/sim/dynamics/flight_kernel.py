"""All ticks of a command: controllers, rotors, air, motion and contacts, drone by drone.

Numbers have single precision within a command and double precision between commands. Positions
count from where the command began, so that an hour loses no more precision than a command.
"""

import warp as wp

from drone_rl.sim.dynamics import rigid_body_kernel as rigid
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import FlightGoals, Mode
from drone_rl.sim.dynamics.control_kernel import Goal, climb_memory, climb_missing, rotors_wanted

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_FASTEST, _FARTHEST, _WILDEST = wp.constant(1000.0), wp.constant(1.0e18), wp.constant(10.0)
"""Bounds of speeds (m/s or rad/s), of squared goals and positions, and of gusts (deviations)."""
_WIDEST = wp.constant(1.0e12)
"""Square metres: no drone flies 1000 km in a command."""


@wp.struct
class FlightCommand:
    """A command to drones, and the obstacles around them. World frame, SI units."""

    frame: rigid.AirframeNumbers
    ticks: int
    modes: wp.vec4i
    goals: wp.array2d[wp.float64]
    drifts: wp.array2d[wp.float64]
    centers: wp.array2d[wp.vec3d]
    half_sizes: wp.vec3


def make_command(
    frame: rigid.AirframeNumbers,
    goals: FlightGoals,
    ticks: int = 1,
    obstacles: fs.Obstacles | None = None,
) -> FlightCommand:
    """Return a command that lasts some ticks, for kernels on the device of the goals."""
    command = FlightCommand()
    command.frame, command.ticks = frame, ticks
    command.modes = wp.vec4i(*(int(mode) for mode in goals.modes))
    command.goals = wp.from_torch(goals.values.contiguous())
    command.drifts = wp.from_torch(goals.drifts.contiguous())
    if obstacles is not None:
        command.centers = wp.from_torch(obstacles.centers.contiguous(), dtype=wp.vec3d)
        command.half_sizes = wp.vec3(*obstacles.half_sizes)
    return command


@wp.struct
class Touch:
    """The last contact of a command."""

    thing: int
    normal: wp.vec3
    point: wp.vec3
    depth: float
    tick: int


@wp.struct
class CommandedDrone:
    """One drone during a command."""

    start: wp.vec3d
    """Where the command began, metres."""
    seed: wp.int64
    """Of the episode's gusts."""
    past: wp.int64
    """Ticks of the episode before the command."""
    tick: int
    """Number of the present tick within the command."""
    motion: rigid.Motion
    rotors: wp.vec4
    climb: float
    gust: wp.vec3
    touch: Touch


@wp.func
def is_sound(motion: rigid.Motion) -> bool:
    """Return whether all numbers are finite and plausible; comparisons with NaN are false."""
    place = wp.length_sq(motion.position)
    speed = wp.length_sq(motion.velocity)
    spin = wp.length_sq(motion.rates)
    turn = wp.length_sq(motion.attitude)
    most = _FASTEST * _FASTEST
    near = place < _WIDEST
    return near and speed < most and spin < most and turn > 0.5 and turn < 2.0


@wp.func
def is_plausible(goal: Goal, start: wp.vec3d) -> bool:
    """Return whether a goal and a position are neither NaN nor absurdly large."""
    wanted = wp.length_sq(goal.values) + wp.length_sq(goal.drift)
    return wanted < _FARTHEST and wp.length_sq(start) < wp.float64(_FARTHEST)


@wp.func
def three(numbers: wp.array2d[wp.float64], world: int, first: int) -> wp.vec3:
    """Return three of a drone's numbers."""
    return wp.vec3(
        float(numbers[world, first]),
        float(numbers[world, first + 1]),
        float(numbers[world, first + 2]),
    )


@wp.func
def four(numbers: wp.array2d[wp.float64], world: int, first: int) -> wp.vec4:
    """Return four of a drone's numbers."""
    return wp.vec4(
        float(numbers[world, first]),
        float(numbers[world, first + 1]),
        float(numbers[world, first + 2]),
        float(numbers[world, first + 3]),
    )


@wp.func
def loaded(before: wp.array2d[wp.float64], world: int) -> CommandedDrone:
    """Return a drone at the start of a command, from its numbers."""
    flight = CommandedDrone()
    for axis in range(3):
        flight.start[axis] = before[world, fs.POSITION + axis]
    flight.seed = wp.int64(before[world, fs.SEED])
    flight.past = wp.int64(before[world, fs.TICKS])
    flight.motion = rigid.Motion()
    flight.motion.attitude = four(before, world, fs.ATTITUDE)
    flight.motion.velocity = three(before, world, fs.VELOCITY)
    flight.motion.rates = three(before, world, fs.RATES)
    flight.rotors = four(before, world, fs.ROTORS)
    flight.climb = float(before[world, fs.CLIMB_INTEGRAL])
    flight.gust = three(before, world, fs.GUST)
    flight.touch = Touch()
    flight.touch.thing = fs.NOTHING
    return flight


@wp.func
def drift_of(command: FlightCommand, world: int) -> wp.vec4d:
    """Return the rates of change of a drone's goal, see `FlightGoals.world_drifts`."""
    drifts = command.drifts[world]
    drift = wp.vec4d(drifts[0], drifts[1], drifts[2], drifts[3])
    if command.modes[0] == Mode.HEADING_POSITION:
        cos = wp.cos(command.goals[world, 2])
        sin = wp.sin(command.goals[world, 2])
        drift[0] = cos * drifts[0] - sin * drifts[1]
        drift[1] = sin * drifts[0] + cos * drifts[1]
    return drift


@wp.func
def goal_of(command: FlightCommand, world: int, start: wp.vec3d) -> Goal:
    """Return a drone's goal; positions count from the start."""
    goal = Goal()
    drift = drift_of(command, world)
    for axis in range(4):
        goal.modes[axis] = command.modes[axis]
        if command.modes[axis] == Mode.HEADING_POSITION:
            goal.modes[axis] = int(Mode.POSITION)
        value = command.goals[world, axis]
        if goal.modes[axis] == Mode.POSITION:
            value = value - start[wp.min(axis, 2)]
        goal.values[axis] = float(value)
        goal.drift[axis] = float(drift[axis])
    return goal


@wp.func
def driven(
    frame: rigid.AirframeNumbers, goal: Goal, before: CommandedDrone, axes: rigid.Axes
) -> CommandedDrone:
    """Return a flight whose controllers, rotors and air are a tick later; it has not moved yet."""
    flight = before
    motion = before.motion
    asked = rotors_wanted(frame, goal, motion, axes, before.climb)
    if goal.modes[3] == Mode.VELOCITY or goal.modes[3] == Mode.POSITION:
        flight.climb = climb_memory(frame, climb_missing(frame, goal, motion), before.climb)
    flight.rotors = rigid.answered(frame, before.rotors, asked)
    if frame.gusts > 0.0:
        speed = wp.length(motion.velocity - frame.wind)
        time = before.past + wp.int64(before.tick)
        flight.gust = rigid.gust_after(frame, before.gust, speed, before.seed, time)
    return flight


@wp.func
def force_on(frame: rigid.AirframeNumbers, flight: CommandedDrone, axes: rigid.Axes) -> wp.vec3:
    """Return the force of rotors and air, newtons, world frame; without weight."""
    through = flight.motion.velocity - frame.wind - flight.gust
    return rigid.thrust_of(frame, flight.rotors) * axes.up + rigid.drag_of(frame, axes, through)


@wp.func
def ticked(frame: rigid.AirframeNumbers, goal: Goal, before: CommandedDrone) -> CommandedDrone:
    """Return a flight a tick later, without any contact."""
    axes = rigid.axes_of(before.motion.attitude)
    flight = driven(frame, goal, before, axes)
    force = force_on(frame, flight, axes)
    flight.motion = rigid.advanced(
        frame, before.motion, force, rigid.torque_of(frame, flight.rotors)
    )
    return flight


@wp.func
def over_ground(frame: rigid.AirframeNumbers, before: CommandedDrone) -> CommandedDrone:
    """Return a flight after bare ground, if the drone touches it, has pushed it back."""
    flight = before
    lift = rigid.thrust_of(frame, flight.rotors)
    overlap = rigid.Overlap()
    overlap.normal = wp.vec3(0.0, 0.0, 1.0)
    overlap.depth = frame.radius - (float(before.start[2]) + flight.motion.position[2])
    if overlap.depth >= 0.0:
        flight.motion = grounded(frame, rigid.pushed_out(frame, flight.motion, overlap), lift)
        flight.touch = touched(frame, flight, fs.GROUND, overlap)
    return flight


@wp.func
def among(command: FlightCommand, world: int, before: CommandedDrone) -> CommandedDrone:
    """Return a flight after the obstacles that it touches have pushed it back."""
    flight = before
    radius = command.frame.radius
    for thing in range(command.centers.shape[1]):
        center = flight.motion.position + wp.vec3(flight.start - command.centers[world, thing])
        overlap = rigid.box_overlap(center, radius, command.half_sizes)
        if overlap.depth > 0.0:
            flight.motion = rigid.pushed_out(command.frame, flight.motion, overlap)
            flight.touch = touched(command.frame, flight, thing, overlap)
    return flight


@wp.func
def is_near(command: FlightCommand, world: int, flight: CommandedDrone) -> bool:
    """Return whether the drone, at its greatest speed, may touch any obstacle in the command."""
    frame = command.frame
    seconds = frame.tick * float(command.ticks)
    air = wp.length(frame.wind) + wp.length(flight.gust) + _WILDEST * frame.gusts
    gain = frame.per_mass * (4.0 * frame.rotor_thrust + frame.weight) * seconds
    fastest = wp.length(flight.motion.velocity) + 2.0 * air + gain
    near = int(0)
    for thing in range(command.centers.shape[1]):
        center = wp.vec3(flight.start - command.centers[world, thing])
        away = rigid.box_overlap(center, frame.radius + fastest * seconds, command.half_sizes)
        if away.depth > 0.0:
            near = 1
    return near == 1


@wp.func
def grounded(frame: rigid.AirframeNumbers, motion: rigid.Motion, lift: float) -> rigid.Motion:
    """Return the motion of a drone on the ground: level if its rotors can't carry it."""
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
    frame: rigid.AirframeNumbers, flight: CommandedDrone, thing: int, overlap: rigid.Overlap
) -> Touch:
    """Return the contact to record: obstacles precede the ground, later contacts earlier ones."""
    if flight.touch.thing >= 0 and thing < 0:
        return flight.touch
    now = Touch()
    now.thing = thing
    now.normal = overlap.normal
    now.depth = overlap.depth
    now.point = flight.motion.position - frame.radius * overlap.normal
    now.tick = flight.tick
    return now


@wp.func
def write(after: wp.array2d[wp.float64], world: int, flight: CommandedDrone, ticks: int) -> None:
    """Write a drone's numbers after some ticks of a command."""
    motion = flight.motion
    for i in range(3):
        after[world, fs.POSITION + i] = flight.start[i] + wp.float64(motion.position[i])
        after[world, fs.VELOCITY + i] = wp.float64(motion.velocity[i])
        after[world, fs.RATES + i] = wp.float64(motion.rates[i])
        after[world, fs.GUST + i] = wp.float64(flight.gust[i])
    for i in range(4):
        after[world, fs.ATTITUDE + i] = wp.float64(motion.attitude[i])
        after[world, fs.ROTORS + i] = wp.float64(flight.rotors[i])
    after[world, fs.CLIMB_INTEGRAL] = wp.float64(flight.climb)
    after[world, fs.TICKS] = wp.float64(flight.past + wp.int64(ticks))


@wp.func
def _write_touch(
    after: wp.array2d[wp.float64], world: int, flight: CommandedDrone, tick: float
) -> None:
    """Write the last contact; `tick` is the duration of a tick in seconds."""
    touch = flight.touch
    after[world, fs.THING] = wp.float64(touch.thing)
    for i in range(3):
        after[world, fs.NORMAL + i] = wp.float64(touch.normal[i])
        after[world, fs.POINT + i] = flight.start[i] + wp.float64(touch.point[i])
    after[world, fs.DEPTH] = wp.float64(touch.depth)
    past = wp.float64(flight.past + wp.int64(touch.tick + 1))
    after[world, fs.TIME] = wp.float64(tick) * past


@wp.func
def _write_reference(command: FlightCommand, after: wp.array2d[wp.float64], world: int) -> None:
    """Write the reference after a command, see `FlightGoals.reference_after`."""
    seconds = wp.float64(command.frame.tick) * wp.float64(command.ticks)
    drift = drift_of(command, world)
    for axis in range(4):
        reference = command.goals[world, axis] + seconds * drift[axis]
        if axis == 2:
            if command.modes[2] != Mode.ANGLE:
                axes = rigid.axes_of(four(after, world, fs.ATTITUDE))
                reference = wp.float64(wp.atan2(axes.forward[1], axes.forward[0]))
        elif command.modes[axis] != Mode.POSITION and command.modes[axis] != Mode.HEADING_POSITION:
            reference = after[world, fs.POSITION + wp.min(axis, 2)]
        after[world, fs.REFERENCE + axis] = reference


@wp.func
def run(
    command: FlightCommand,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
    world: int,
) -> None:
    """Run all ticks of a command for one drone; `before` and `after` may be the same array."""
    frame = command.frame
    flight = loaded(before, world)
    goal = goal_of(command, world, flight.start)
    near = False
    if command.centers.shape[1] > 0:
        near = is_near(command, world, flight)
    for tick in range(command.ticks):
        flight.tick = tick
        goal.seconds = frame.tick * float(tick)
        flight = over_ground(frame, ticked(frame, goal, flight))
        if near:
            flight = among(command, world, flight)
    finish(command, goal, flight, before, after, world)


@wp.func
def finish(
    command: FlightCommand,
    goal: Goal,
    flight: CommandedDrone,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
    world: int,
) -> None:
    """Write the numbers of a drone after all ticks of a command."""
    frame = command.frame
    lost = before[world, fs.LOST] != wp.float64(0.0) or not is_plausible(goal, flight.start)
    for i in range(fs.NUMBERS):
        after[world, i] = before[world, i]
    if lost or not is_sound(flight.motion):
        after[world, fs.LOST] = wp.float64(1.0)
        for i in range(fs.VELOCITY, fs.ROTORS):
            after[world, i] = wp.float64(0.0)
        return
    write(after, world, flight, command.ticks)
    _write_reference(command, after, world)
    if flight.touch.thing != fs.NOTHING:
        _write_touch(after, world, flight, frame.tick)


@wp.kernel
def fly(
    first: int,
    command: FlightCommand,
    before: wp.array2d[wp.float64],
    after: wp.array2d[wp.float64],
) -> None:
    """Run a command for drones, a thread each; `first` is the first thread's drone."""
    run(command, before, after, first + wp.tid())
