"""Ideal instruments: what a flight controller measures of one drone."""

import dataclasses
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drone_rl.config.dynamics import GRAVITY
from drone_rl.sim.coordinates import HOME, GeoPoint, geo_from_world
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.dynamics.state import heading_of
from drone_rl.sim.sensors.instruments import standard_pressure

Vector = NDArray[np.float64]


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
        return standard_pressure(self.altitude)

    @property
    def heading(self) -> float:
        """Yaw: radians to the left of north, -pi to pi."""
        return float(heading_of(torch.from_numpy(self.attitude)))


def measure(before: BodyState, after: BodyState, seconds: float, time: float) -> Readings:
    """Measure the motion of the first drone between two states, at its end.

    Rates and forces are averages over the interval of `seconds`, from attitudes and velocities, so
    that they include collisions. `time` is that of the end.
    """
    position, velocity, attitude = map(first_row, (after.position, after.velocity, after.attitude))
    acceleration = (velocity - first_row(before.velocity)) / seconds
    turned = rotation(attitude)
    turn = rotation(first_row(before.attitude)).inv() * turned
    return Readings(
        time=time,
        position=position,
        velocity=velocity,
        attitude=attitude,
        rates=turn.as_rotvec() / seconds,
        force=turned.apply(acceleration + np.array([0.0, 0.0, GRAVITY]), inverse=True),
    )


def rotation(attitude: Vector) -> Any:
    """Return a quaternion (w, x, y, z) as scipy's rotation, from the body frame to the world's."""
    return Rotation.from_quat(attitude[[1, 2, 3, 0]])


def first_row(values: torch.Tensor) -> Vector:
    """Convert the first row of a batch to NumPy, float64."""
    return values[0].detach().cpu().numpy().astype(np.float64)
