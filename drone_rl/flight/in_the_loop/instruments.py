"""Ideal instruments: what a flight controller measures of one drone."""

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
"""Pressure of the standard atmosphere at sea level, pascals."""


@dataclasses.dataclass(frozen=True)
class Readings:
    """Measurements of one drone at one time.

    World frame: x forward (north), y left, z up. Body frame: x forward, y left, z up.
    """

    time: float
    """Seconds."""
    position: Vector
    """Metres, world frame. Shape: (3,)."""
    velocity: Vector
    """Metres per second, world frame. Shape: (3,)."""
    attitude: Vector
    """Quaternion (w, x, y, z) from the body frame to the world frame. Shape: (4,)."""
    rates: Vector
    """Gyroscope: radians per second about the body axes. Shape: (3,)."""
    force: Vector
    """Accelerometer: specific force in the body frame, m/s2. A drone at rest measures
    (0, 0, 9.81). Shape: (3,)."""
    home: GeoPoint = HOME
    """The world's origin on Earth."""

    @property
    def place(self) -> Vector:
        """Latitude and longitude in degrees, altitude in metres. Shape: (3,)."""
        return geo_from_world(self.position, self.home)

    @property
    def altitude(self) -> float:
        """Metres above the ellipsoid, which counts as sea level."""
        return self.home.altitude + float(self.position[2])

    @property
    def pressure(self) -> float:
        """Air pressure, pascals."""
        return pressure_at(self.altitude)

    @property
    def heading(self) -> float:
        """Yaw: radians to the left of north, -pi to pi."""
        w, x, y, z = self.attitude
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def measure(before: BodyState, after: BodyState, seconds: float, time: float) -> Readings:
    """Measure the motion of the first drone between two states, at its end.

    Rates and forces are averages over the interval of `seconds`, from attitudes and velocities, so
    that they include collisions. `time` is that of the end.
    """
    position, velocity, attitude = map(first_row, (after.position, after.velocity, after.attitude))
    acceleration = (velocity - first_row(before.velocity)) / seconds
    return Readings(
        time=time,
        position=position,
        velocity=velocity,
        attitude=attitude,
        rates=rotation_between(first_row(before.attitude), attitude) / seconds,
        force=into_body(attitude, acceleration + np.array([0.0, 0.0, GRAVITY])),
    )


def pressure_at(altitude: float) -> float:
    """Return the pressure of the standard atmosphere (below 11 km), pascals."""
    return SEA_LEVEL_PRESSURE * (1.0 - 2.25577e-5 * altitude) ** 5.25588


def rotation_between(before: Vector, after: Vector) -> Vector:
    """Return the rotation vector between two attitudes, radians about the body axes.

    The attitudes are quaternions (w, x, y, z), less than half a turn apart.
    """
    w, axis = before[0] * after[0] + before[1:] @ after[1:], before[0] * after[1:]
    axis = axis - after[0] * before[1:] - np.cross(before[1:], after[1:])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return 2.0 * axis
    angle = 2.0 * math.atan2(sine, abs(float(w)))
    return axis * math.copysign(angle / sine, float(w))


def into_body(attitude: Vector, vector: Vector) -> Vector:
    """Rotate a world vector into the frame of a body. Shapes: (4,), (3,)."""
    axis = -attitude[1:]
    twice = 2.0 * np.cross(axis, vector)
    return vector + attitude[0] * twice + np.cross(axis, twice)


def first_row(values: torch.Tensor) -> Vector:
    """Convert the first row of a batch to NumPy, float64."""
    return values[0].detach().cpu().numpy().astype(np.float64)
