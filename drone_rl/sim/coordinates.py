"""Conversions of coordinates: NED, ENU and FRD frames, angles, latitude and longitude.

Our frames are x forward (north), y left, z up, for the world and for bodies. NED is north, east,
down, with bodies forward, right, down (FRD), as in AirSim and PX4. ENU is east, north, up, as in
ROS. Unit quaternions (w, x, y, z) rotate the body's frame into the world's.

Angles are as Fig. 4 of the chapter and AirSim have them: to a pilot, positive roll lowers the right
side, positive pitch raises the nose, and positive yaw turns to the right, clockwise from above. The
simulator's drone frame has x forward, y left and z up, where rotations about y and z have the other
sign. Positions and velocities are in the simulator's frames everywhere; AirSim's own have y to the
right and z down.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering.appearance import product, rotate, turned

Values = TypeVar("Values", Tensor, NDArray[Any])
"""A tensor or an array; functions return the kind that they take."""


def ned_from_world(vector: Values) -> Values:
    """Convert positions, velocities or directions of our world to NED. Shape: (*, 3)."""
    return _signed(vector, (1.0, -1.0, -1.0))


def ned_attitude_from_world(attitude: Values) -> Values:
    """Convert attitudes of our bodies to those of FRD bodies in NED. Shape: (*, 4)."""
    return _signed(attitude, (1.0, 1.0, -1.0, -1.0))


world_from_ned = ned_from_world
"""`ned_from_world` is its own inverse, and so is `ned_attitude_from_world`."""
frd_from_body = ned_from_world
"""The same for vectors, or rates about the axes, of our body's frame and FRD."""


def enu_from_world(vector: Values) -> Values:
    """Convert positions, velocities or directions of our world to ENU. Shape: (*, 3)."""
    return _signed(vector[..., [1, 0, 2]], (-1.0, 1.0, 1.0))


def inverse(attitude: Tensor) -> Tensor:
    """Return the attitudes that undo given ones. Shape: (*, 4)."""
    return _signed(attitude, (1.0, -1.0, -1.0, -1.0))


def body_from_world(attitude: Tensor, vector: Tensor) -> Tensor:
    """Return vectors of our world's frame along the axes of bodies. Shapes: (*, 4) and (*, 3)."""
    return rotate(inverse(attitude), vector)


def _signed(values: Values, signs: tuple[float, ...]) -> Values:
    if isinstance(values, Tensor):
        return values * torch.tensor(signs, dtype=values.dtype, device=values.device)
    return values * np.array(signs, dtype=values.dtype)


Angles = tuple[float, float, float]
_VERTICAL = 1.0 - 1e-12
"""Sine of the pitch above which roll and yaw can't be distinguished."""


def to_simulator(roll: float, pitch: float, yaw: float) -> Angles:
    """Convert a pilot's angles or rates about the drone's axes to the simulator's; units kept."""
    return roll, 0.0 - pitch, 0.0 - yaw  # not -0.0


to_pilot = to_simulator
"""`to_simulator` is its own inverse."""


def attitude_of(roll: float, pitch: float, yaw: float) -> Tensor:
    """Return the quaternion (w, x, y, z) of a pilot's angles, degrees. Shape: (4,), float64."""
    x, y, z = to_simulator(roll, pitch, yaw)
    return product(product(turned("yaw", z), turned("pitch", y)), turned("roll", x))


@dataclasses.dataclass(frozen=True)
class Attitude:
    """Orientation in degrees, applied in the order yaw, pitch, roll; signs as a pilot has them.

    With the nose straight up or down, where yaw and roll turn about the same axis, roll is 0.
    """

    roll: float
    """Positive with the right side down."""
    pitch: float
    """Positive with the nose up."""
    yaw: float
    """Positive to the right of the world's x axis."""

    @classmethod
    def of(cls, quaternion: Sequence[float]) -> Self:
        """Convert a unit quaternion (w, x, y, z); straight up or down the roll is 0."""
        w, x, y, z = quaternion
        sine = 2.0 * (w * y - z * x)
        if abs(sine) > _VERTICAL:  # roll and yaw turn about the same axis
            pitch, yaw = math.copysign(math.pi / 2, sine), 2.0 * math.atan2(z, w)
            return cls(*np.degrees(to_pilot(0.0, pitch, math.remainder(yaw, math.tau))).tolist())
        roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = math.asin(sine)
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return cls(*np.degrees(to_pilot(roll, pitch, yaw)).tolist())


EQUATOR_RADIUS, FLATTENING = 6378137.0, 1 / 298.257223563
"""Of WGS84's ellipsoid; the radius in metres."""
_ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)


class GeoPoint(NamedTuple):
    """A place on Earth: degrees north and east, and metres above the ellipsoid."""

    latitude: float
    longitude: float
    altitude: float


HOME = GeoPoint(47.641468, -122.140165, 122.0)
"""The origin of AirSim's environments."""


def geo_from_world(position: Values, home: GeoPoint = HOME) -> Values:
    """Return latitude and longitude in degrees, altitude in metres. Shapes: (*, 3), float64.

    Positions are metres from home: north, west, up. The world is flat and level, as AirSim's is;
    north and east are measured along the meridian and the parallel of WGS84's ellipsoid. Within 1
    km of home, horizontal positions are within 0.1 m of those of the tangent plane; heights differ
    by up to 0.08 m, because Earth is curved.
    """
    library: Any = torch if isinstance(position, Tensor) else np
    across, meridian = _curvature_radii(home)
    north, west, up = position[..., 0], position[..., 1], position[..., 2]
    latitude = home.latitude + math.degrees(1.0) * north / (meridian + home.altitude)
    parallel = library.cos(latitude * math.radians(1.0)) * (across + home.altitude)
    longitude = home.longitude - math.degrees(1.0) * west / parallel
    longitude = (longitude + 180.0) % 360.0 - 180.0
    return library.stack([latitude, longitude, home.altitude + up], -1)


def world_from_geo(place: Values, home: GeoPoint = HOME) -> Values:
    """Return metres from home, north, west and up; the inverse of `geo_from_world`."""
    library: Any = torch if isinstance(place, Tensor) else np
    across, meridian = _curvature_radii(home)
    latitude, longitude, altitude = place[..., 0], place[..., 1], place[..., 2]
    north = math.radians(1.0) * (latitude - home.latitude) * (meridian + home.altitude)
    east = (longitude - home.longitude + 180.0) % 360.0 - 180.0
    parallel = library.cos(latitude * math.radians(1.0)) * (across + home.altitude)
    west = -math.radians(1.0) * east * parallel
    return library.stack([north, west, altitude - home.altitude], -1)


def _curvature_radii(home: GeoPoint) -> tuple[float, float]:
    """Return the ellipsoid's radii of curvature across and along the meridian, metres."""
    flatness = 1 - _ECCENTRICITY_2 * math.sin(math.radians(home.latitude)) ** 2
    across = EQUATOR_RADIUS / math.sqrt(flatness)
    return across, across * (1 - _ECCENTRICITY_2) / flatness
