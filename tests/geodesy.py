"""The inverse of `geo_from_world`, by the radii of curvature at home."""

import numpy as np
import torch

from drone_rl.sim.coordinates import EQUATOR_RADIUS, FLATTENING, HOME


def world_from_geo(place, home=HOME):
    """Metres from home, north, west and up, of latitude, longitude and altitude."""
    library = torch if isinstance(place, torch.Tensor) else np
    squared = FLATTENING * (2 - FLATTENING)
    share = 1 - squared * np.sin(np.radians(home.latitude)) ** 2
    across = EQUATOR_RADIUS / np.sqrt(share)
    meridian = across * (1 - squared) / share
    latitude, longitude, altitude = place[..., 0], place[..., 1], place[..., 2]
    north = float(np.radians(1.0)) * (latitude - home.latitude) * float(meridian + home.altitude)
    east = (longitude - home.longitude + 180.0) % 360.0 - 180.0
    parallel = library.cos(latitude * float(np.radians(1.0))) * float(across + home.altitude)
    west = -float(np.radians(1.0)) * east * parallel
    return library.stack([north, west, altitude - home.altitude], -1)
