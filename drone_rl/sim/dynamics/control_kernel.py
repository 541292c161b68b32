"""SimpleFlight's controllers in a cascade: position, velocity, attitude, rates, rotors.

Each maps an error (target minus state) to a fraction, -1 to 1, of a limit. Body frame: x forward, y
left, z up; roll to the right, pitch down and yaw to the left are positive. SI units, radians.
"""

import warp as wp

from drone_rl.sim.dynamics.control import Mode
from drone_rl.sim.dynamics.rigid_body_kernel import AirframeNumbers, Axes, Motion

wp.set_module_options({"enable_backward": False})


@wp.func
def within(value: float, limit: float) -> float:
    """Clip a value to -limit and limit."""
    return wp.max(wp.min(value, limit), -limit)


@wp.func
def turned(angle: float) -> float:
    """Return the same angle between -pi and pi."""
    return angle - 2.0 * wp.pi * wp.round(angle / (2.0 * wp.pi))


@wp.func
def position_control(frame: AirframeNumbers, missing: wp.vec3) -> wp.vec3:
    """Return the velocity towards a place from the position error. Metres, metres a second."""
    gain = frame.position_gain
    return wp.vec3(
        within(gain * missing[0], 1.0) * frame.velocity_limit,
        within(gain * missing[1], 1.0) * frame.velocity_limit,
        within(gain * missing[2], 1.0) * frame.climb_limit,
    )


@wp.func
def velocity_control(frame: AirframeNumbers, missing: wp.vec2) -> wp.vec2:
    """Return roll and pitch from the velocity error forward and left of the heading."""
    gain = frame.velocity_gain
    return wp.vec2(
        -within(gain * missing[1], 1.0) * frame.angle_limit,
        within(gain * missing[0], 1.0) * frame.angle_limit,
    )


@wp.func
def climb_control(frame: AirframeNumbers, missing: float, integral: float) -> float:
    """Return the throttle, 0 to 1, from the error of the climb rate and its integral."""
    return 0.5 + 0.5 * within(frame.climb_gain * missing + integral, 1.0)


@wp.func
def climb_memory(frame: AirframeNumbers, missing: float, integral: float) -> float:
    """Return the integral of `climb_control` after a tick, within -1 and 1."""
    return within(integral + frame.climb_integral * missing * frame.tick, 1.0)


@wp.func
def attitude_control(frame: AirframeNumbers, missing: wp.vec3) -> wp.vec3:
    """Return rates about the body's axes from the error of roll, pitch and yaw."""
    return wp.vec3(
        within(frame.angle_gain[0] * missing[0], 1.0) * frame.rate_limit[0],
        within(frame.angle_gain[1] * missing[1], 1.0) * frame.rate_limit[1],
        within(frame.angle_gain[2] * missing[2], 1.0) * frame.rate_limit[2],
    )


@wp.func
def rate_control(frame: AirframeNumbers, missing: wp.vec3) -> wp.vec3:
    """Return torques, as fractions of the most about each axis, from the error of rates."""
    return wp.vec3(
        within(frame.rate_gain[0] * missing[0], 1.0),
        within(frame.rate_gain[1] * missing[1], 1.0),
        within(frame.rate_gain[2] * missing[2], 1.0),
    )


@wp.func
def mix(throttle: float, torque: wp.vec3) -> wp.vec4:
    """Return fractions of full thrust: front right, rear left, front left, rear right.

    `throttle` is a fraction of all thrust, 0 to 1; torques, see `rate_control`. Below 0, all four
    are raised equally, which keeps the torques; above 1, all four are scaled down.
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


@wp.struct
class Goal:
    """Goal of one drone, see `FlightGoals`; positions count from where the command began."""

    modes: wp.vec4i
    values: wp.vec4
    drift: wp.vec4
    seconds: float
    """Since the command began."""


@wp.func
def _angles_wanted(frame: AirframeNumbers, goal: Goal, motion: Motion, axes: Axes) -> wp.vec2:
    """Return roll and pitch for goals of positions, velocities or angles."""
    if goal.modes[0] == Mode.ANGLE or goal.modes[0] == Mode.RATE:
        return wp.vec2(goal.values[0], goal.values[1])
    length = axes.forward[0] * axes.forward[0] + axes.forward[1] * axes.forward[1]
    norm = 1.0 / wp.sqrt(wp.max(length, 1.0e-12))
    cos = axes.forward[0] * norm
    sin = axes.forward[1] * norm
    x = motion.velocity[0]
    y = motion.velocity[1]
    if goal.modes[0] == Mode.HEADING_VELOCITY:
        forward = goal.values[0] - (cos * x + sin * y)
        left = goal.values[1] - (cos * y - sin * x)
        return velocity_control(frame, wp.vec2(forward, left))
    wanted_x = goal.values[0]
    wanted_y = goal.values[1]
    if goal.modes[0] == Mode.POSITION:
        away = wp.vec3(
            goal.values[0] + goal.drift[0] * goal.seconds - motion.position[0],
            goal.values[1] + goal.drift[1] * goal.seconds - motion.position[1],
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
def climb_missing(frame: AirframeNumbers, goal: Goal, motion: Motion) -> float:
    """Return the error of the climb rate, metres a second."""
    wanted = goal.values[3]
    if goal.modes[3] == Mode.POSITION:
        away = goal.values[3] + goal.drift[3] * goal.seconds - motion.position[2]
        back = position_control(frame, wp.vec3(0.0, 0.0, away))
        wanted = within(goal.drift[3] + back[2], frame.climb_limit)
    return wanted - motion.velocity[2]


@wp.func
def _rates_wanted(frame: AirframeNumbers, goal: Goal, motion: Motion, axes: Axes) -> wp.vec3:
    """Return rates about the body's axes for a goal."""
    angles = _angles_wanted(frame, goal, motion, axes)
    roll = wp.atan2(axes.left[2], axes.up[2])
    pitch = wp.asin(wp.clamp(-axes.forward[2], -1.0, 1.0))
    turn = 0.0
    if goal.modes[2] == Mode.ANGLE:
        heading = wp.atan2(axes.forward[1], axes.forward[0])
        turn = turned(goal.values[2] + goal.drift[2] * goal.seconds - heading)
    missing = wp.vec3(turned(angles[0] - roll), angles[1] - pitch, turn)
    wanted = attitude_control(frame, missing)
    if goal.modes[0] == Mode.RATE:
        wanted[0] = within(goal.values[0], frame.rate_limit[0])
        wanted[1] = within(goal.values[1], frame.rate_limit[1])
    if goal.modes[2] == Mode.RATE:
        wanted[2] = within(goal.values[2], frame.rate_limit[2])
    elif goal.modes[2] == Mode.ANGLE:
        wanted[2] = within(wanted[2] + goal.drift[2], frame.rate_limit[2])
    return wanted


@wp.func
def rotors_wanted(
    frame: AirframeNumbers, goal: Goal, motion: Motion, axes: Axes, climb: float
) -> wp.vec4:
    """Return the fractions of full thrust that the cascade sets."""
    if goal.modes[3] == Mode.ROTOR:
        return goal.values
    throttle = goal.values[3]
    if goal.modes[3] != Mode.THROTTLE:
        throttle = climb_control(frame, climb_missing(frame, goal, motion), climb)
    rates = _rates_wanted(frame, goal, motion, axes)
    return mix(wp.clamp(throttle, 0.0, 1.0), rate_control(frame, rates - motion.rates))
