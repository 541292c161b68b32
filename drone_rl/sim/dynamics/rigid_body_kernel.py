"""A rigid body with rotors in moving air, in SI units: forces, gusts, contacts, and its motion.

World and body frame: x forward, y left, z up. A tick is MuJoCo's semi-implicit Euler: velocities
first, then the pose. Gusts have Dryden's longitudinal spectrum along each axis: white noise through
a filter of first order with time constant length scale over airspeed (MIL-F-8785C).
"""

import math

import warp as wp

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY

wp.set_module_options({"enable_backward": False})


@wp.struct
class AirframeNumbers:
    """Fields of `DynamicsSettings` and what follows from them, in single precision and SI units."""

    tick: float
    weight: float
    per_mass: float
    inertia: wp.vec3
    per_inertia: wp.vec3
    arm: float
    """Distance of each rotor ahead and to the side, metres."""
    rotor_thrust: float
    rotor_torque: float
    rotor_pace: float
    """Fraction of the difference that a rotor gains in a tick."""
    drag: wp.vec3
    """Newtons for each (m/s)^2, along each axis."""
    radius: float
    restitution: float
    friction: float
    wind: wp.vec3
    gusts: float
    gust_length: float
    rate_gain: wp.vec3
    rate_limit: wp.vec3
    angle_gain: wp.vec3
    angle_limit: float
    velocity_gain: float
    velocity_limit: float
    climb_gain: float
    climb_integral: float
    climb_limit: float
    position_gain: float


def make_airframe(settings: DynamicsSettings) -> AirframeNumbers:
    """Return the numbers of settings, and what follows from them."""
    frame = AirframeNumbers()
    same = set(vars(frame)) & settings.values().keys()
    for name in same:
        value = getattr(settings, name)
        setattr(frame, name, wp.vec3(*value) if isinstance(value, tuple) else value)
    lag = settings.rotor_time_constant
    frame.weight = settings.mass * GRAVITY
    frame.per_mass = 1.0 / settings.mass
    frame.per_inertia = wp.vec3(*(1.0 / moment for moment in settings.inertia))
    frame.arm = settings.arm_length / math.sqrt(2.0)
    frame.rotor_pace = 1.0 - math.exp(-settings.tick / lag) if lag else 1.0
    frame.drag = wp.vec3(*(settings.air_density * area for area in settings.drag_area))
    return frame


@wp.struct
class Motion:
    """Motion of one drone; the attitude is a quaternion (w, x, y, z)."""

    position: wp.vec3
    """From where the command began, metres: so that single precision loses nothing."""
    attitude: wp.vec4
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
    """Return the columns of the rotation matrix."""
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
def answered(frame: AirframeNumbers, rotors: wp.vec4, asked: wp.vec4) -> wp.vec4:
    """Return rotors a tick later: a first-order filter of what is commanded."""
    return rotors + frame.rotor_pace * (asked - rotors)


@wp.func
def thrust_of(frame: AirframeNumbers, rotors: wp.vec4) -> float:
    """Return the thrust along the body's z, newtons."""
    return frame.rotor_thrust * (rotors[0] + rotors[1] + rotors[2] + rotors[3])


@wp.func
def torque_of(frame: AirframeNumbers, rotors: wp.vec4) -> wp.vec3:
    """Return the torque about the body's axes, newton metres, of rotors ordered as in `mix`."""
    lever = frame.arm * frame.rotor_thrust
    return wp.vec3(
        lever * (rotors[1] + rotors[2] - rotors[0] - rotors[3]),
        lever * (rotors[1] + rotors[3] - rotors[0] - rotors[2]),
        frame.rotor_torque * (rotors[2] + rotors[3] - rotors[0] - rotors[1]),
    )


@wp.func
def drag_of(frame: AirframeNumbers, axes: Axes, velocity: wp.vec3) -> wp.vec3:
    """Return the drag at a velocity through the air; newtons, metres a second, world frame."""
    forward = wp.dot(axes.forward, velocity)
    left = wp.dot(axes.left, velocity)
    up = wp.dot(axes.up, velocity)
    return -(
        frame.drag[0] * wp.abs(forward) * forward * axes.forward
        + frame.drag[1] * wp.abs(left) * left * axes.left
        + frame.drag[2] * wp.abs(up) * up * axes.up
    )


@wp.func
def advanced(frame: AirframeNumbers, motion: Motion, force: wp.vec3, torque: wp.vec3) -> Motion:
    """Return the motion after a tick of force without weight (N, world) and torque (N m, body)."""
    tick = frame.tick
    rates = motion.rates
    spin = wp.cw_mul(frame.inertia, rates)
    rates = rates + tick * wp.cw_mul(frame.per_inertia, torque - wp.cross(rates, spin))
    velocity = motion.velocity + tick * frame.per_mass * (force - wp.vec3(0.0, 0.0, frame.weight))
    after = Motion()
    after.position = motion.position + tick * velocity
    after.velocity = velocity
    after.rates = rates
    after.attitude = _turned_by(motion.attitude, tick * rates)
    return after


@wp.func
def _turned_by(attitude: wp.vec4, angle: wp.vec3) -> wp.vec4:
    """Return an attitude of length 1 after a small rotation about the body's axes, radians."""
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
    square_length = new_w * new_w + new_x * new_x + new_y * new_y + new_z * new_z
    norm = 1.5 - 0.5 * square_length
    return wp.vec4(norm * new_w, norm * new_x, norm * new_y, norm * new_z)


SLOWEST = wp.constant(1.0)
"""Airspeed in metres a second below which gusts change no slower."""
_SPREAD = wp.constant(3.4641016151377544)
"""Width of a uniform distribution of variance 1."""


@wp.func
def gust_after(
    frame: AirframeNumbers, gust: wp.vec3, airspeed: float, seed: wp.int64, tick: wp.int64
) -> wp.vec3:
    """Return the air's velocity minus its mean a tick later; metres a second, world frame.

    `airspeed` is the drone's through air without gusts: otherwise gusts against the wind would last
    longer than others, and bias the mean. Each `tick` of the episode has its own randomness.
    """
    decay = wp.exp(-frame.tick * wp.max(airspeed, SLOWEST) / frame.gust_length)
    strength = _SPREAD * frame.gusts * wp.sqrt(1.0 - decay * decay)
    source = wp.rand_init(wp.int32(seed & wp.int64(0x7FFFFFFF)), wp.int32(tick))
    noise = wp.vec3(wp.randf(source) - 0.5, wp.randf(source) - 0.5, wp.randf(source) - 0.5)
    return decay * gust + strength * noise


REST_SPEED = wp.constant(0.1)
"""Speed into a contact, metres a second, below which nothing bounces."""


@wp.struct
class Overlap:
    """Overlap of a ball with an object."""

    normal: wp.vec3
    """Out of the object."""
    depth: float
    """Metres; below 0 where they are apart."""


@wp.func
def box_overlap(center: wp.vec3, radius: float, half: wp.vec3) -> Overlap:
    """Return how far a ball overlaps a box; `center` is in the box's frame. Metres."""
    overlap = Overlap()
    nearest = wp.vec3(
        wp.clamp(center[0], -half[0], half[0]),
        wp.clamp(center[1], -half[1], half[1]),
        wp.clamp(center[2], -half[2], half[2]),
    )
    away = center - nearest
    distance = wp.length(away)
    if distance > 0.0:
        overlap.normal = away / distance
        overlap.depth = radius - distance
        return overlap
    inside = wp.vec3(
        half[0] - wp.abs(center[0]), half[1] - wp.abs(center[1]), half[2] - wp.abs(center[2])
    )
    if inside[0] <= inside[1] and inside[0] <= inside[2]:
        overlap.normal = wp.vec3(wp.sign(center[0]), 0.0, 0.0)
        overlap.depth = radius + inside[0]
    elif inside[1] <= inside[2]:
        overlap.normal = wp.vec3(0.0, wp.sign(center[1]), 0.0)
        overlap.depth = radius + inside[1]
    else:
        overlap.normal = wp.vec3(0.0, 0.0, wp.sign(center[2]))
        overlap.depth = radius + inside[2]
    return overlap


@wp.func
def _bounced(frame: AirframeNumbers, velocity: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """Return the velocity after a contact: Newton's restitution and Coulomb's friction."""
    into = -wp.dot(velocity, normal)
    if into <= 0.0:
        return velocity
    share = 0.0
    if into > REST_SPEED:
        share = frame.restitution
    along = velocity + into * normal
    speed = wp.length(along)
    loss = frame.friction * (1.0 + share) * into
    kept = wp.max(speed - loss, 0.0) / wp.max(speed, 1.0e-9)
    return kept * along + share * into * normal


@wp.func
def pushed_out(frame: AirframeNumbers, motion: Motion, overlap: Overlap) -> Motion:
    """Return the motion of a drone that no longer overlaps an object."""
    after = motion
    after.position = motion.position + overlap.depth * overlap.normal
    after.velocity = _bounced(frame, motion.velocity, overlap.normal)
    return after
