"""What flawless instruments tell a flight controller about one drone."""

import dataclasses
import math

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.config.dynamics import GRAVITY
from drone_rl.sim.coordinates import HOME, GeoPoint, geo_from_world
from drone_rl.sim.dynamics import BodyState

Vector = NDArray[np.float64]
SEA_LEVEL_PRESSURE = 101_325.0
"""Of the standard atmosphere, pascals."""


@dataclasses.dataclass(frozen=True)
class Senses:
    """One drone at one moment.

    World frame: x forward, which is north, y left, z up. Body frame: x forward, y left, z up.
    """

    time: float
    """Seconds."""
    position: Vector
    """Metres, world frame. Shape: (3,)."""
    velocity: Vector
    """Metres a second, world frame. Shape: (3,)."""
    attitude: Vector
    """Quaternion (w, x, y, z) from the body's frame to the world's. Shape: (4,)."""
    rates: Vector
    """Of a gyroscope: radians a second about the body's axes. Shape: (3,)."""
    force: Vector
    """Of an accelerometer: all but gravity for each kilogram, metres a second squared, body frame.
    A drone at rest feels (0, 0, 9.81). Shape: (3,)."""
    home: GeoPoint = HOME
    """Where on Earth the world's origin is."""

    @property
    def place(self) -> Vector:
        """Latitude and longitude in degrees, altitude in metres. Shape: (3,)."""
        return geo_from_world(self.position, self.home)

    @property
    def altitude(self) -> float:
        """Metres above the sea."""
        return self.home.altitude + float(self.position[2])

    @property
    def pressure(self) -> float:
        """Of the air, pascals."""
        return pressure_at(self.altitude)

    @property
    def heading(self) -> float:
        """Yaw: radians to the left of north, -pi to pi."""
        w, x, y, z = self.attitude
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def sense(
    before: BodyState, after: BodyState, seconds: float, time: float, home: GeoPoint = HOME
) -> Senses:
    """What instruments measure of the motion between two states, at its end.

    Rates and forces are the mean ones in between, worked out of attitudes and velocities: so what
    a bump does is felt, too.

    Args:
        before: A drone; of several, the first.
        after: The same a little later.
        seconds: How much later.
        time: Of the end.
        home: Where on Earth the world's origin is.
    """
    position, velocity, attitude = map(_first, (after.position, after.velocity, after.attitude))
    acceleration = (velocity - _first(before.velocity)) / seconds
    return Senses(
        time=time,
        position=position,
        velocity=velocity,
        attitude=attitude,
        rates=turn_between(_first(before.attitude), attitude) / seconds,
        force=into_body(attitude, acceleration + np.array([0.0, 0.0, GRAVITY])),
        home=home,
    )


def pressure_at(altitude: float) -> float:
    """Of the standard atmosphere below 11 km, pascals.

    Args:
        altitude: Metres above the sea.
    """
    return SEA_LEVEL_PRESSURE * (1.0 - 2.25577e-5 * altitude) ** 5.25588


def turn_between(before: Vector, after: Vector) -> Vector:
    """The rotation vector, radians about the body's axes, from one attitude to another.

    Args:
        before: Quaternion (w, x, y, z).
        after: Another, not half a turn away.
    """
    w, axis = before[0] * after[0] + before[1:] @ after[1:], before[0] * after[1:]
    axis = axis - after[0] * before[1:] - np.cross(before[1:], after[1:])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return 2.0 * axis
    angle = 2.0 * math.atan2(sine, abs(float(w)))
    return axis * math.copysign(angle / sine, float(w))


def into_body(attitude: Vector, vector: Vector) -> Vector:
    """A vector of the world in the frame of a body with this attitude. Shapes: (4,), (3,)."""
    axis = -attitude[1:]
    twice = 2.0 * np.cross(axis, vector)
    return vector + attitude[0] * twice + np.cross(axis, twice)


def _first(values: torch.Tensor) -> Vector:
    return values[0].detach().cpu().numpy().astype(np.float64)
