"""Places on Earth: between metres from home and latitude, longitude, altitude.

The world is flat and level at every distance, as AirSim's is: a drone that keeps its z keeps its
altitude. North and east are measured along the meridian and the parallel of WGS84's ellipsoid, with
the meridian's curvature taken at home. Both ways are exact inverses of each other; within 1 km of
home, places are within 0.1 m of those of the plane that touches the ellipsoid there.
"""

import math
from typing import NamedTuple

import numpy as np
from torch import Tensor

from drone_rl.sim.frames import Values

EQUATOR_RADIUS = 6378137.0
"""Of WGS84's ellipsoid, in metres."""
FLATTENING = 1 / 298.257223563
"""The same's."""
_ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)


class GeoPoint(NamedTuple):
    """A place on Earth."""

    latitude: float
    """Degrees north."""
    longitude: float
    """Degrees east."""
    altitude: float
    """Metres above the sea."""


HOME = GeoPoint(47.641468, -122.140165, 122.0)
"""Where AirSim's worlds have their origin."""


def geo_from_world(position: Values, home: GeoPoint = HOME) -> Values:
    """Latitude and longitude in degrees, altitude in metres.

    Args:
        position: Metres from home, world frame: north, west, up. Shape: (*, 3), float64.
        home: The world's origin.

    Returns:
        Shape: (*, 3), float64.
    """
    meridian, _ = _radii(home.latitude)
    north, west, up = position[..., 0], position[..., 1], position[..., 2]
    latitude = home.latitude + math.degrees(1.0) * north / (meridian + home.altitude)
    parallel = _parallel(latitude, home)
    longitude = home.longitude - math.degrees(1.0) * west / parallel
    return _written(position, latitude, (longitude + 180.0) % 360.0 - 180.0, home.altitude + up)


def world_from_geo(place: Values, home: GeoPoint = HOME) -> Values:
    """The way back: metres from home, world frame.

    Args:
        place: Latitude and longitude in degrees, altitude in metres. Shape: (*, 3), float64.
        home: The world's origin.

    Returns:
        Shape: (*, 3), float64.
    """
    meridian, _ = _radii(home.latitude)
    latitude, longitude, altitude = place[..., 0], place[..., 1], place[..., 2]
    north = math.radians(1.0) * (latitude - home.latitude) * (meridian + home.altitude)
    east = (longitude - home.longitude + 180.0) % 360.0 - 180.0
    west = -math.radians(1.0) * east * _parallel(latitude, home)
    return _written(place, north, west, altitude - home.altitude)


def _radii(latitude: float) -> tuple[float, float]:
    """Radii of curvature along the meridian and across it, metres."""
    share = 1 - _ECCENTRICITY_2 * math.sin(math.radians(latitude)) ** 2
    across = EQUATOR_RADIUS / math.sqrt(share)
    return across * (1 - _ECCENTRICITY_2) / share, across


def _parallel(latitude: Values, home: GeoPoint) -> Values:
    """Radius of the circle around Earth's axis at a latitude, metres."""
    _, across = _radii(home.latitude)
    turn = latitude * math.radians(1.0)
    if isinstance(turn, Tensor):
        return turn.cos() * (across + home.altitude)
    return np.cos(turn) * (across + home.altitude)


def _written(like: Values, x: Values, y: Values, z: Values) -> Values:
    """Three numbers each, in what is like another."""
    made = 0.0 * like
    made[..., 0], made[..., 1], made[..., 2] = x, y, z
    return made
