# pyright: reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportAssignmentType=false
# (Warp compiles this file; Python's types say nothing about it, and what a loop changes is declared
# by its type.)
"""From what a drone is told to what its rotors are asked for, controller after controller."""

import warp as wp

from drone_rl.sim.dynamics.airframe import Airframe
from drone_rl.sim.dynamics.controllers import (
    attitude_control,
    climb_control,
    mix,
    position_control,
    rate_control,
    turned,
    velocity_control,
    within,
)
from drone_rl.sim.dynamics.goals import Mode
from drone_rl.sim.dynamics.rigid_body import Axes, Motion

THROTTLE = wp.constant(int(Mode.THROTTLE))
RATE = wp.constant(int(Mode.RATE))
ANGLE = wp.constant(int(Mode.ANGLE))
VELOCITY = wp.constant(int(Mode.VELOCITY))
HEADING_VELOCITY = wp.constant(int(Mode.HEADING_VELOCITY))
POSITION = wp.constant(int(Mode.POSITION))
ROTOR = wp.constant(int(Mode.ROTOR))

wp.set_module_options({"enable_backward": False})


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
