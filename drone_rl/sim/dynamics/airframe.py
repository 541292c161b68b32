# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""A drone, its controller's gains and the air around it as kernels know them."""

import math

import warp as wp

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY


@wp.struct
class Airframe:
    """See `DynamicsSettings`, whose names these are, in single precision."""

    tick: float
    weight: float
    """Newtons."""
    per_mass: float
    """One over the mass."""
    inertia: wp.vec3
    per_inertia: wp.vec3
    arm: float
    """How far ahead and to the side each rotor stands, metres."""
    rotor_thrust: float
    rotor_torque: float
    rotor_pace: float
    """Share of what is missing that a rotor gains in a tick."""
    drag: wp.vec3
    """Newtons for each square of a metre a second, along each axis."""
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


def make_airframe(settings: DynamicsSettings) -> Airframe:
    """The numbers of some settings, and what can be worked out of them beforehand."""
    frame = Airframe()
    same = set(vars(frame)) & {*settings.values()}
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
