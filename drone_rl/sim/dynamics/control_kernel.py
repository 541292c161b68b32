"""SimpleFlight's controllers in a cascade: position, velocity, attitude, rates, rotors.

Each is a function of what is wanted, what is and the gains, and knows nothing of the others. What
one asks of the next is a share of the most that it may: every output is held within -1 and 1.
Body frame: x forward, y left, z up; roll to the right, pitch down and yaw to the left are positive.
SI units, radians.
"""

import warp as wp

from drone_rl.sim.dynamics.control import Mode
from drone_rl.sim.dynamics.rigid_body_kernel import Airframe, Axes, Motion

wp.set_module_options({"enable_backward": False})


@wp.func
def within(value: float, limit: float) -> float:
    """A value, or the limit that it is beyond."""
    return wp.max(wp.min(value, limit), -limit)


@wp.func
def turned(angle: float) -> float:
    """The same angle between -pi and pi."""
    return angle - 2.0 * wp.pi * wp.round(angle / (2.0 * wp.pi))


@wp.func
def position_control(frame: Airframe, missing: wp.vec3) -> wp.vec3:
    """The velocity that leads to a place.

    Args:
        frame: Gains and limits.
        missing: From where the drone is to where it should be, metres.

    Returns:
        Metres a second, in the same frame; within the limits along each axis.
    """
    gain = frame.position_gain
    return wp.vec3(
        within(gain * missing[0], 1.0) * frame.velocity_limit,
        within(gain * missing[1], 1.0) * frame.velocity_limit,
        within(gain * missing[2], 1.0) * frame.climb_limit,
    )


@wp.func
def velocity_control(frame: Airframe, missing: wp.vec2) -> wp.vec2:
    """Roll and pitch that lead to a horizontal velocity.

    Args:
        frame: Gains and limits.
        missing: Velocity forward and to the left of the drone's heading, metres a second.

    Returns:
        Roll and pitch, radians; within the limit.
    """
    gain = frame.velocity_gain
    return wp.vec2(
        -within(gain * missing[1], 1.0) * frame.angle_limit,
        within(gain * missing[0], 1.0) * frame.angle_limit,
    )


@wp.func
def climb_control(frame: Airframe, missing: float, integral: float) -> float:
    """The throttle that leads to a rate of climb.

    Args:
        frame: Gains.
        missing: Rate of climb, metres a second.
        integral: What has been missing so far, see `climb_memory`.

    Returns:
        Share of all thrust, 0 to 1.
    """
    return 0.5 + 0.5 * within(frame.climb_gain * missing + integral, 1.0)


@wp.func
def climb_memory(frame: Airframe, missing: float, integral: float) -> float:
    """What `climb_control` must remember after a tick, within -1 and 1."""
    return within(integral + frame.climb_integral * missing * frame.tick, 1.0)


@wp.func
def attitude_control(frame: Airframe, missing: wp.vec3) -> wp.vec3:
    """The rates that lead to an attitude.

    Args:
        frame: Gains and limits.
        missing: Roll, pitch and yaw, radians.

    Returns:
        About the body's axes, radians a second; within the limits.
    """
    return wp.vec3(
        within(frame.angle_gain[0] * missing[0], 1.0) * frame.rate_limit[0],
        within(frame.angle_gain[1] * missing[1], 1.0) * frame.rate_limit[1],
        within(frame.angle_gain[2] * missing[2], 1.0) * frame.rate_limit[2],
    )


@wp.func
def rate_control(frame: Airframe, missing: wp.vec3) -> wp.vec3:
    """The torques that lead to rates.

    Args:
        frame: Gains.
        missing: About the body's axes, radians a second.

    Returns:
        Shares of what rotors can do about each axis, -1 to 1.
    """
    return wp.vec3(
        within(frame.rate_gain[0] * missing[0], 1.0),
        within(frame.rate_gain[1] * missing[1], 1.0),
        within(frame.rate_gain[2] * missing[2], 1.0),
    )


@wp.func
def mix(throttle: float, torque: wp.vec3) -> wp.vec4:
    """What each rotor must do; where that can't be, torques come before thrust.

    Args:
        throttle: Share of all thrust, 0 to 1.
        torque: From `rate_control`.

    Returns:
        Shares of each rotor's thrust, 0 to 1: front right, rear left, front left, rear right.
    """
    front_right = throttle - torque[0] - torque[1] - torque[2]
    rear_left = throttle + torque[0] + torque[1] - torque[2]
    front_left = throttle + torque[0] - torque[1] + torque[2]
    rear_right = throttle - torque[0] + torque[1] + torque[2]
    least = wp.min(wp.min(front_right, rear_left), wp.min(front_left, rear_right))
    lift = wp.max(-least, 0.0)
    most = wp.max(wp.max(front_right, rear_left), wp.max(front_left, rear_right)) + lift
    scale = 1.0 / wp.max(most, 1.0)
    return wp.vec4(
        (front_right + lift) * scale,
        (rear_left + lift) * scale,
        (front_left + lift) * scale,
        (rear_right + lift) * scale,
    )


THROTTLE = wp.constant(int(Mode.THROTTLE))
RATE = wp.constant(int(Mode.RATE))
ANGLE = wp.constant(int(Mode.ANGLE))
VELOCITY = wp.constant(int(Mode.VELOCITY))
HEADING_VELOCITY = wp.constant(int(Mode.HEADING_VELOCITY))
POSITION = wp.constant(int(Mode.POSITION))
ROTOR = wp.constant(int(Mode.ROTOR))


@wp.struct
class Goal:
    """What one drone is told; see `Goals`."""

    values: wp.vec4
    """Places count from where the command began."""
    drift: wp.vec4


@wp.func
def angles_wanted(
    frame: Airframe, modes: wp.vec4i, goal: Goal, seconds: float, motion: Motion, axes: Axes
) -> wp.vec2:
    """Roll and pitch, radians, that places, velocities or angles ask for."""
    if modes[0] == ANGLE or modes[0] == RATE:
        return wp.vec2(goal.values[0], goal.values[1])
    length = axes.forward[0] * axes.forward[0] + axes.forward[1] * axes.forward[1]
    norm = 1.0 / wp.sqrt(wp.max(length, 1.0e-12))
    cos = axes.forward[0] * norm
    sin = axes.forward[1] * norm
    x = motion.velocity[0]
    y = motion.velocity[1]
    if modes[0] == HEADING_VELOCITY:
        forward = goal.values[0] - (cos * x + sin * y)
        left = goal.values[1] - (cos * y - sin * x)
        return velocity_control(frame, wp.vec2(forward, left))
    wanted_x = goal.values[0]
    wanted_y = goal.values[1]
    if modes[0] == POSITION:
        away = wp.vec3(
            goal.values[0] + goal.drift[0] * seconds - motion.position[0],
            goal.values[1] + goal.drift[1] * seconds - motion.position[1],
            0.0,
        )
        back = position_control(frame, away)
        wanted_x = within(goal.drift[0] + back[0], frame.velocity_limit)
        wanted_y = within(goal.drift[1] + back[1], frame.velocity_limit)
    miss_x = wanted_x - x
    miss_y = wanted_y - y
    return velocity_control(
        frame, wp.vec2(cos * miss_x + sin * miss_y, cos * miss_y - sin * miss_x)
    )


@wp.func
def climb_missing(
    frame: Airframe, modes: wp.vec4i, goal: Goal, seconds: float, motion: Motion
) -> float:
    """Metres a second between the rate of climb that is wanted and the one that there is."""
    wanted = goal.values[3]
    if modes[3] == POSITION:
        away = goal.values[3] + goal.drift[3] * seconds - motion.position[2]
        back = position_control(frame, wp.vec3(0.0, 0.0, away))
        wanted = within(goal.drift[3] + back[2], frame.climb_limit)
    return wanted - motion.velocity[2]


@wp.func
def rates_wanted(
    frame: Airframe,
    modes: wp.vec4i,
    goal: Goal,
    seconds: float,
    motion: Motion,
    axes: Axes,
) -> wp.vec3:
    """Rates about the body's axes, radians a second, that goals ask for."""
    angles = angles_wanted(frame, modes, goal, seconds, motion, axes)
    roll = wp.atan2(axes.left[2], axes.up[2])
    pitch = wp.asin(wp.clamp(-axes.forward[2], -1.0, 1.0))
    turn = 0.0
    if modes[2] == ANGLE:
        heading = wp.atan2(axes.forward[1], axes.forward[0])
        turn = turned(goal.values[2] + goal.drift[2] * seconds - heading)
    missing = wp.vec3(turned(angles[0] - roll), angles[1] - pitch, turn)
    wanted = attitude_control(frame, missing)
    if modes[0] == RATE:
        wanted[0] = within(goal.values[0], frame.rate_limit[0])
        wanted[1] = within(goal.values[1], frame.rate_limit[1])
    if modes[2] == RATE:
        wanted[2] = within(goal.values[2], frame.rate_limit[2])
    elif modes[2] == ANGLE:
        wanted[2] = within(wanted[2] + goal.drift[2], frame.rate_limit[2])
    return wanted


@wp.func
def rotors_wanted(
    frame: Airframe,
    modes: wp.vec4i,
    goal: Goal,
    seconds: float,
    motion: Motion,
    axes: Axes,
    climb: float,
) -> wp.vec4:
    """What the whole cascade asks of the rotors, shares of their most thrust."""
    if modes[3] == ROTOR:
        return goal.values
    throttle = goal.values[3]
    if modes[3] != THROTTLE:
        throttle = climb_control(frame, climb_missing(frame, modes, goal, seconds, motion), climb)
    rates = rates_wanted(frame, modes, goal, seconds, motion, axes)
    return mix(wp.clamp(throttle, 0.0, 1.0), rate_control(frame, rates - motion.rates))
