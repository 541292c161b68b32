"""NED, ENU and FRD frames, latitude and longitude."""

import dataclasses
import math

import numpy as np
import pytest
import torch

from drone_rl.sim import coordinates
from drone_rl.sim.coordinates import (
    EQUATOR_RADIUS,
    FLATTENING,
    HOME,
    Attitude,
    geo_from_world,
    world_from_geo,
)
from drone_rl.sim.rendering.appearance import rotate

KINDS = [np.array, lambda rows: torch.tensor(rows, dtype=torch.float64)]


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
def test_round_trip_within_1_km(kind):
    random = np.random.default_rng(0)
    given = kind(random.uniform(-1000.0, 1000.0, (100, 3)).tolist())
    back = world_from_geo(geo_from_world(given))
    assert type(back) is type(given)
    assert abs(back - given).max() < 1e-6


def test_lengths_of_degrees_match_tables():
    """Tables: 111.179 and 75.14 km at 47.64 degrees; 122 m of altitude add 2e-5."""
    north = world_from_geo(np.array([HOME.latitude + 0.001, HOME.longitude, 122.0]))
    np.testing.assert_allclose(north, [111.179, 0.0, 0.0], atol=0.01)
    east = world_from_geo(np.array([HOME.latitude, HOME.longitude + 0.001, 130.0]))
    np.testing.assert_allclose(east, [0.0, -75.14, 8.0], atol=0.01)


def test_longitudes_continue_across_the_date_line():
    home = HOME._replace(longitude=179.9999)
    there = geo_from_world(np.array([0.0, -1000.0, 0.0]), home)
    assert there[1] == pytest.approx(179.9999 - 360.0 + 1000.0 / 75140.0, abs=1e-4)
    np.testing.assert_allclose(world_from_geo(there, home), [0.0, -1000.0, 0.0], atol=1e-6)


def test_ellipsoid_is_wgs84():
    """Compare polar radius and squared eccentricity with published values."""
    assert pytest.approx(6356752.314245, abs=1e-5) == EQUATOR_RADIUS * (1 - FLATTENING)
    assert pytest.approx(6.69437999014e-3, abs=1e-13) == FLATTENING * (2 - FLATTENING)
    north = world_from_geo(np.array([HOME.latitude + 1e-3, HOME.longitude, 0.0]), HOME)
    share = 1 - 6.69437999014e-3 * np.sin(np.radians(HOME.latitude)) ** 2
    meridian = 6378137.0 * (1 - 6.69437999014e-3) / share**1.5 + 122.0
    assert north[0] == pytest.approx(np.radians(1e-3) * meridian, rel=1e-9)


HALF = math.sqrt(0.5)


VECTORS = [
    (coordinates.ned_from_world, coordinates.world_from_ned, [1.0, 2.0, 3.0], [1.0, -2.0, -3.0]),
    # 1 m north, 2 m west, 3 m up is -2 m east.
    (coordinates.enu_from_world, None, [1.0, 2.0, 3.0], [-2.0, 1.0, 3.0]),
    (coordinates.frd_from_body, None, [0.1, 0.2, -0.3], [0.1, -0.2, 0.3]),
]


NED = (coordinates.ned_attitude_from_world, coordinates.ned_attitude_from_world)


ATTITUDES = [
    # 90 degrees to the left: the nose points west.
    (*NED, (HALF, 0.0, 0.0, HALF), (HALF, 0.0, 0.0, -HALF)),
    # 90 degrees about the axis between forward and left; in NED, left is -y.
    (*NED, (HALF, 0.5, 0.5, 0.0), (HALF, 0.5, -0.5, 0.0)),
]


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
@pytest.mark.parametrize(("there", "back", "ours", "theirs"), VECTORS)
def test_vectors_round_trip(kind, there, back, ours, theirs):
    given, expected = kind([ours, ours]), kind([theirs, theirs])
    assert type(there(given)) is type(given)
    assert (there(given) == expected).all()
    assert back is None or (back(expected) == given).all()
    assert there(given).dtype == given.dtype


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
@pytest.mark.parametrize(("there", "back", "ours", "theirs"), ATTITUDES)
def test_attitudes_round_trip(kind, there, back, ours, theirs):
    given, expected = kind([list(ours)]), kind([list(theirs)])
    np.testing.assert_allclose(there(given), expected, atol=1e-15)
    np.testing.assert_allclose(back(expected), given, atol=1e-15)


def test_rotation_commutes_with_the_change_of_frame():
    """Rotating before a change of frame equals rotating after it."""
    generator = torch.Generator().manual_seed(0)
    attitude = torch.randn(50, 4, dtype=torch.float64, generator=generator)
    attitude = attitude / attitude.norm(dim=-1, keepdim=True)
    vector = torch.randn(50, 3, dtype=torch.float64, generator=generator)
    world = rotate(attitude, vector)
    in_ned = rotate(
        coordinates.ned_attitude_from_world(attitude), coordinates.frd_from_body(vector)
    )
    torch.testing.assert_close(in_ned, coordinates.ned_from_world(world))


def test_vectors_in_the_frame_of_a_rotated_body():
    """A body that faces left has north on its right."""
    left = torch.tensor([[HALF, 0.0, 0.0, HALF]], dtype=torch.float64)
    north = torch.tensor([[1.0, 0.0, 0.0]], dtype=torch.float64)
    right = torch.tensor([[0.0, -1.0, 0.0]], dtype=torch.float64)
    torch.testing.assert_close(coordinates.body_from_world(left, north), right)


def test_attitude_of_a_drone_that_is_nearly_upside_down():
    """Turned by 150 degrees about its forward axis: the right side goes down first."""
    half = math.radians(150.0) / 2
    attitude = Attitude.of((math.cos(half), math.sin(half), 0.0, 0.0))
    assert dataclasses.astuple(attitude) == pytest.approx((150.0, 0.0, 0.0))
