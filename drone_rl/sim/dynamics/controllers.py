# pyright: reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# (Warp compiles this file; Python's types say nothing about it.)
"""SimpleFlight's controllers in a cascade: position, velocity, attitude, rates, rotors.

Each is a function of what is wanted, what is and the gains, and knows nothing of the others. What
one asks of the next is a share of the most that it may: every output is held within -1 and 1.
Body frame: x forward, y left, z up; roll to the right, pitch down and yaw to the left are positive.
SI units, radians.
"""

import warp as wp

from drone_rl.sim.dynamics.airframe import Airframe

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
