# pyright: reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# (Warp compiles this file; Python's types say nothing about it.)
"""A rigid body with rotors in moving air: forces, and a tick of motion under them.

World frame: x forward, y left, z up; body frame the same where the drone is level and looks
forward. SI units. A tick is MuJoCo's own (semi-implicit Euler): velocities first, by the forces of
where the body is; then its pose, by the new velocities.
"""

import warp as wp

from drone_rl.sim.dynamics.airframe import Airframe

wp.set_module_options({"enable_backward": False})


@wp.struct
class Motion:
    """Of one drone."""

    position: wp.vec3
    """From where the command began, metres: so that single precision loses nothing."""
    attitude: wp.vec4
    """Quaternion (w, x, y, z)."""
    velocity: wp.vec3
    rates: wp.vec3
    """About the body's axes, radians a second."""


@wp.struct
class Axes:
    """The body's axes in the world's frame."""

    forward: wp.vec3
    left: wp.vec3
    up: wp.vec3


@wp.func
def axes_of(attitude: wp.vec4) -> Axes:
    """The columns of the rotation matrix."""
    w = attitude[0]
    x = attitude[1]
    y = attitude[2]
    z = attitude[3]
    axes = Axes()
    axes.forward = wp.vec3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    )
    axes.left = wp.vec3(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x))
    axes.up = wp.vec3(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
    return axes


@wp.func
def answered(frame: Airframe, rotors: wp.vec4, asked: wp.vec4) -> wp.vec4:
    """What rotors do a tick after they are asked; they answer like a filter of first order."""
    return rotors + frame.rotor_pace * (asked - rotors)


@wp.func
def thrust_of(frame: Airframe, rotors: wp.vec4) -> float:
    """Along the body's z, newtons."""
    return frame.rotor_thrust * (rotors[0] + rotors[1] + rotors[2] + rotors[3])


@wp.func
def torque_of(frame: Airframe, rotors: wp.vec4) -> wp.vec3:
    """About the body's axes, newton metres.

    Front right and rear left turn against the clock, seen from above, and so push the body with it.
    """
    lever = frame.arm * frame.rotor_thrust
    return wp.vec3(
        lever * (rotors[1] + rotors[2] - rotors[0] - rotors[3]),
        lever * (rotors[1] + rotors[3] - rotors[0] - rotors[2]),
        frame.rotor_torque * (rotors[2] + rotors[3] - rotors[0] - rotors[1]),
    )


@wp.func
def drag_of(frame: Airframe, axes: Axes, velocity: wp.vec3) -> wp.vec3:
    """What the air does to a body, newtons, world frame.

    Args:
        frame: The drone.
        axes: The body's.
        velocity: Through the air, metres a second, world frame.
    """
    forward = wp.dot(axes.forward, velocity)
    left = wp.dot(axes.left, velocity)
    up = wp.dot(axes.up, velocity)
    return -(
        frame.drag[0] * wp.abs(forward) * forward * axes.forward
        + frame.drag[1] * wp.abs(left) * left * axes.left
        + frame.drag[2] * wp.abs(up) * up * axes.up
    )


@wp.func
def advanced(frame: Airframe, motion: Motion, force: wp.vec3, torque: wp.vec3) -> Motion:
    """The motion a tick later.

    Args:
        frame: The drone.
        motion: Before.
        force: All but weight, newtons, world frame.
        torque: Newton metres, body frame.
    """
    tick = frame.tick
    rates = motion.rates
    spin = wp.cw_mul(frame.inertia, rates)
    rates = rates + tick * wp.cw_mul(frame.per_inertia, torque - wp.cross(rates, spin))
    velocity = motion.velocity + tick * frame.per_mass * (force - wp.vec3(0.0, 0.0, frame.weight))
    after = Motion()
    after.position = motion.position + tick * velocity
    after.velocity = velocity
    after.rates = rates
    after.attitude = turned_by(motion.attitude, tick * rates)
    return after


@wp.func
def turned_by(attitude: wp.vec4, angle: wp.vec3) -> wp.vec4:
    """An attitude after a small rotation about the body's axes, radians; of length 1."""
    square = wp.dot(angle, angle)
    c = 1.0 - square * (0.125 - square / 384.0)
    s = 0.5 - square * (1.0 / 48.0 - square / 3840.0)
    w = attitude[0]
    x = attitude[1]
    y = attitude[2]
    z = attitude[3]
    a = s * angle[0]
    b = s * angle[1]
    d = s * angle[2]
    new_w = w * c - x * a - y * b - z * d
    new_x = w * a + x * c + y * d - z * b
    new_y = w * b - x * d + y * c + z * a
    new_z = w * d + x * b - y * a + z * c
    length = new_w * new_w + new_x * new_x + new_y * new_y + new_z * new_z
    norm = 1.5 - 0.5 * length
    return wp.vec4(norm * new_w, norm * new_x, norm * new_y, norm * new_z)
