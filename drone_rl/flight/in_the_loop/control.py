"""Outer control loops: from goals and velocity setpoints to the sticks of Betaflight's ANGLE mode.

Pure functions of one drone. World frame: x forward, y left, z up. Roll to the right, pitch down and
yaw to the left are positive; gains and limits are those of `DynamicsSettings`.
"""

import dataclasses
import math

import numpy as np

from drone_rl.config import DynamicsSettings
from drone_rl.flight.in_the_loop.instruments import Readings, Vector, first_row
from drone_rl.sim.dynamics import FlightGoals, Mode
from drone_rl.sim.dynamics.control import HEADING, Y, Z
from drone_rl.utils.errors import InputError

LOWEST, MIDDLE, HIGHEST = 1000, 1500, 2000
"""RC channel values, microseconds."""
FULL_ANGLE = math.radians(60.0)
"""Roll or pitch at full stick."""
FULL_YAW_RATE = math.radians(200.0)
"""Yaw rate at full stick, per second."""
HEADING_GAIN = 1.5
"""Yaw rate per radian of heading error, per second."""
IN_FLIGHT = 0.1
"""Least throttle in the air; below 0.05 the firmware assumes that the drone has landed."""
_PLACES = (Mode.POSITION, Mode.HEADING_POSITION)
_SIDEWAYS = (*_PLACES, Mode.VELOCITY, Mode.HEADING_VELOCITY)
_HEADINGS = (Mode.ANGLE, Mode.RATE)
_HEIGHTS = (Mode.POSITION, Mode.VELOCITY)


@dataclasses.dataclass(frozen=True)
class Setpoint:
    """Velocity and heading to track."""

    velocity: tuple[float, float, float]
    """Metres per second, world frame."""
    heading: float = 0.0
    """Radians to the left of the world's x axis."""
    yaw_rate: float | None = None
    """Yaw rate in place of the heading, radians per second to the left."""


@dataclasses.dataclass(frozen=True)
class RcSticks:
    """Stick positions of the remote control."""

    roll: float = 0.0
    """Fraction of `FULL_ANGLE` to the right, -1 to 1."""
    pitch: float = 0.0
    """Fraction of `FULL_ANGLE` nose down, -1 to 1."""
    throttle: float = 0.0
    """0 to 1."""
    yaw: float = 0.0
    """Fraction of `FULL_YAW_RATE` to the left, -1 to 1."""
    armed: bool = False
    """Whether the arming switch is on."""

    @property
    def channels(self) -> list[int]:
        """Roll, pitch, throttle, yaw, arming switch, ANGLE switch; microseconds."""
        return [
            _channel(self.roll),
            _channel(self.pitch),
            round(LOWEST + (HIGHEST - LOWEST) * _clamp(self.throttle, 0.0, 1.0)),
            _channel(-self.yaw),  # a stick to the right turns right
            HIGHEST if self.armed else LOWEST,
            HIGHEST,
        ]


AT_REST = RcSticks()
"""Centred sticks, throttle low, arming switch off."""


def velocity_to(
    target: Vector, readings: Readings, settings: DynamicsSettings
) -> tuple[float, float, float]:
    """Position loop: return the velocity towards a position (metres, world frame; shape (3,)).

    It is in metres per second, along the straight line where the limit is reached.
    """
    missing = target - readings.position
    flat = settings.position_gain * settings.velocity_limit * missing[:2]
    flat = flat * min(1.0, settings.velocity_limit / max(float(np.linalg.norm(flat)), 1e-9))
    up = settings.climb_limit * _clamp(settings.position_gain * float(missing[2]))
    return float(flat[0]), float(flat[1]), up


def sticks_for(
    setpoint: Setpoint,
    readings: Readings,
    integral: float,
    seconds: float,
    settings: DynamicsSettings,
) -> tuple[RcSticks, float]:
    """Velocity and heading loops: return the sticks that track a setpoint, armed.

    Also return the new integral of the climb controller, a fraction of half the thrust; `integral`
    is the one `seconds` before.
    """
    missing = np.array(setpoint.velocity) - readings.velocity
    cosine, sine = math.cos(readings.heading), math.sin(readings.heading)
    ahead = cosine * missing[0] + sine * missing[1]
    left = -sine * missing[0] + cosine * missing[1]
    tilt = settings.angle_limit / FULL_ANGLE
    up = float(missing[2])
    integral = _clamp(integral + settings.climb_integral * up * seconds)
    throttle = 0.5 + 0.5 * _clamp(settings.climb_gain * up + integral)
    turn = HEADING_GAIN * math.remainder(setpoint.heading - readings.heading, math.tau)
    rate = turn if setpoint.yaw_rate is None else setpoint.yaw_rate
    sticks = RcSticks(
        roll=-tilt * _clamp(settings.velocity_gain * float(left)),
        pitch=tilt * _clamp(settings.velocity_gain * float(ahead)),
        throttle=max(throttle, IN_FLIGHT),
        yaw=_clamp(rate / FULL_YAW_RATE),
        armed=True,
    )
    return sticks, integral


def setpoint_of(
    goals: FlightGoals, since: float, readings: Readings, settings: DynamicsSettings
) -> Setpoint:
    """Convert the first drone's goals to a setpoint, as the cascade of internal controllers does.

    Positions and headings drift since the goals were set, so renew the setpoint often.

    Raises:
        InputError: The goals are not positions, velocities and headings.
    """
    sideways, _, heading, height = goals.modes
    if sideways not in _SIDEWAYS or heading not in _HEADINGS or height not in _HEIGHTS:
        names = ", ".join(mode.name.lower() for mode in goals.modes)
        raise InputError(f"modes={names} are no setpoint; give velocities or positions")
    values, drifts = first_row(goals.values), first_row(goals.world_drifts)
    wanted = values + drifts * since
    to_place = velocity_to(wanted[[0, Y, Z]], readings, settings)
    x, y = float(values[0]), float(values[Y])
    if sideways in _PLACES:
        limit = settings.velocity_limit
        x, y = (_clamp(to_place[i] + float(drifts[i]), -limit, limit) for i in (0, Y))
    elif sideways is Mode.HEADING_VELOCITY:
        cosine, sine = math.cos(readings.heading), math.sin(readings.heading)
        x, y = cosine * x - sine * y, sine * x + cosine * y
    up = to_place[2] + float(drifts[Z]) if height is Mode.POSITION else float(values[Z])
    velocity = (x, y, _clamp(up, -settings.climb_limit, settings.climb_limit))
    if heading is Mode.RATE:
        return Setpoint(velocity, readings.heading, yaw_rate=float(wanted[HEADING]))
    return Setpoint(velocity, float(wanted[HEADING]))


def _channel(share: float) -> int:
    return round(MIDDLE + (HIGHEST - MIDDLE) * _clamp(share))


def _clamp(value: float, low: float = -1.0, high: float = 1.0) -> float:
    return max(low, min(high, value))
