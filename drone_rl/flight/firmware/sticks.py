"""Our velocity and position loops as a pilot's hands: from where to go to the sticks of ANGLE mode.

Pure functions of one drone. World frame: x forward, y left, z up. Roll to the right, pitch down and
yaw to the left are positive, as everywhere; gains and limits are those of `DynamicsSettings`.
"""

import dataclasses
import math

import numpy as np

from drone_rl.config import DynamicsSettings
from drone_rl.flight.firmware.betaflight import HIGHEST, LOWEST, MIDDLE
from drone_rl.flight.firmware.senses import Senses, Vector

FULL_ANGLE = math.radians(60.0)
"""Roll or pitch that a full stick asks for."""
FULL_YAW_RATE = math.radians(200.0)
"""Yaw rate that a full stick asks for, a second."""
HEADING_GAIN = 1.5
"""Yaw rate for each radian of heading that is missing, a second."""
IN_FLIGHT = 0.1
"""Least throttle in the air: below a twentieth the firmware takes it that the drone stands."""


@dataclasses.dataclass(frozen=True)
class Wish:
    """Where a drone is to go from now on."""

    velocity: tuple[float, float, float]
    """Metres a second, world frame."""
    heading: float = 0.0
    """Where to look: radians to the left of the world's x."""
    yaw_rate: float | None = None
    """How fast to turn instead, wherever that leads: radians a second to the left."""


@dataclasses.dataclass(frozen=True)
class Sticks:
    """What a pilot's hands do."""

    roll: float = 0.0
    """Share of `FULL_ANGLE` to the right, -1 to 1."""
    pitch: float = 0.0
    """Share of `FULL_ANGLE` nose down, -1 to 1."""
    throttle: float = 0.0
    """0 to 1."""
    yaw: float = 0.0
    """Share of `FULL_YAW_RATE` to the left, -1 to 1."""
    armed: bool = False

    @property
    def channels(self) -> list[int]:
        """Roll, pitch, throttle, yaw, arming switch, ANGLE switch; microseconds."""
        return [
            _channel(self.roll),
            _channel(self.pitch),
            round(LOWEST + (HIGHEST - LOWEST) * _within(self.throttle, 0.0, 1.0)),
            _channel(-self.yaw),  # a stick to the right turns right
            HIGHEST if self.armed else LOWEST,
            HIGHEST,
        ]


AT_REST = Sticks()


@dataclasses.dataclass(frozen=True)
class Climb:
    """What the loop of the climb remembers."""

    integral: float = 0.0
    """Share of half the thrust."""


def velocity_to(
    target: Vector, senses: Senses, settings: DynamicsSettings, speed: float | None = None
) -> tuple[float, float, float]:
    """The position loop: the velocity that leads to a place.

    Args:
        target: Metres, world frame. Shape: (3,).
        senses: Of the drone.
        settings: Gains and limits.
        speed: Greatest horizontal speed; that of the settings by default.

    Returns:
        Metres a second, world frame; along the straight line where the limit is reached.
    """
    missing = target - senses.position
    most = settings.velocity_limit if speed is None else min(speed, settings.velocity_limit)
    flat = settings.position_gain * settings.velocity_limit * missing[:2]
    flat = flat * min(1.0, most / max(float(np.linalg.norm(flat)), 1e-9))
    up = settings.climb_limit * _within(settings.position_gain * float(missing[2]))
    return float(flat[0]), float(flat[1]), up


def sticks_for(
    wish: Wish, senses: Senses, climb: Climb, seconds: float, settings: DynamicsSettings
) -> tuple[Sticks, Climb]:
    """The velocity loop, and that of the heading: the sticks that lead to what is wished.

    Args:
        wish: Velocity and heading.
        senses: Of the drone.
        climb: What was remembered.
        seconds: Since then.
        settings: Gains and limits.

    Returns:
        The sticks, armed, and what to remember.
    """
    missing = np.array(wish.velocity) - senses.velocity
    cosine, sine = math.cos(senses.heading), math.sin(senses.heading)
    ahead = cosine * missing[0] + sine * missing[1]
    left = -sine * missing[0] + cosine * missing[1]
    tilt = settings.angle_limit / FULL_ANGLE
    up = float(missing[2])
    integral = _within(climb.integral + settings.climb_integral * up * seconds)
    throttle = 0.5 + 0.5 * _within(settings.climb_gain * up + integral)
    turn = HEADING_GAIN * math.remainder(wish.heading - senses.heading, math.tau)
    rate = turn if wish.yaw_rate is None else wish.yaw_rate
    sticks = Sticks(
        roll=-tilt * _within(settings.velocity_gain * float(left)),
        pitch=tilt * _within(settings.velocity_gain * float(ahead)),
        throttle=max(throttle, IN_FLIGHT),
        yaw=_within(rate / FULL_YAW_RATE),
        armed=True,
    )
    return sticks, Climb(integral)


def _channel(share: float) -> int:
    return round(MIDDLE + (HIGHEST - MIDDLE) * _within(share))


def _within(value: float, low: float = -1.0, high: float = 1.0) -> float:
    return max(low, min(high, value))
