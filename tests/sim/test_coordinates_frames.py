import math

import numpy as np
import pytest
import torch

from drone_rl.sim import coordinates
from drone_rl.sim.rendering.appearance import rotate, turned

HALF = math.sqrt(0.5)
KINDS = [np.array, lambda rows: torch.tensor(rows, dtype=torch.float64)]
VECTORS = [
    (coordinates.ned_from_world, coordinates.world_from_ned, [1.0, 2.0, 3.0], [1.0, -2.0, -3.0]),
    # 1 m north, 2 m west, 3 m up is 2 m on the other side of east.
    (coordinates.enu_from_world, coordinates.world_from_enu, [1.0, 2.0, 3.0], [-2.0, 1.0, 3.0]),
    (coordinates.frd_from_body, coordinates.body_from_frd, [0.1, 0.2, -0.3], [0.1, -0.2, 0.3]),
]
NED = (coordinates.ned_attitude_from_world, coordinates.world_attitude_from_ned)
ENU = (coordinates.enu_attitude_from_world, coordinates.world_attitude_from_enu)
ATTITUDES = [
    # A quarter turn to the left: the nose points west, a quarter turn anticlockwise from above.
    (*NED, (HALF, 0.0, 0.0, HALF), (HALF, 0.0, 0.0, -HALF)),
    # A quarter turn about the axis between forward and left; in NED, left is minus y.
    (*NED, (HALF, 0.5, 0.5, 0.0), (HALF, 0.5, -0.5, 0.0)),
    # Half a turn from east to west, which is where a quarter turn left of north looks.
    (*ENU, (HALF, 0.0, 0.0, HALF), (0.0, 0.0, 0.0, 1.0)),
    # Level and looking north: a quarter turn left of east.
    (*ENU, (1.0, 0.0, 0.0, 0.0), (HALF, 0.0, 0.0, HALF)),
]


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
@pytest.mark.parametrize(("there", "back", "ours", "theirs"), VECTORS)
def test_vectors_both_ways(kind, there, back, ours, theirs):
    given, expected = kind([ours, ours]), kind([theirs, theirs])
    assert type(there(given)) is type(given)
    assert (there(given) == expected).all() and (back(expected) == given).all()
    assert there(given).dtype == given.dtype


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
@pytest.mark.parametrize(("there", "back", "ours", "theirs"), ATTITUDES)
def test_attitudes_both_ways(kind, there, back, ours, theirs):
    given, expected = kind([list(ours)]), kind([list(theirs)])
    np.testing.assert_allclose(there(given), expected, atol=1e-15)
    np.testing.assert_allclose(back(expected), given, atol=1e-15)


def test_a_turned_vector_is_the_same_in_every_frame():
    """Turning then changing the frame is changing the frame then turning."""
    generator = torch.Generator().manual_seed(0)
    attitude = torch.randn(50, 4, dtype=torch.float64, generator=generator)
    attitude = attitude / attitude.norm(dim=-1, keepdim=True)
    vector = torch.randn(50, 3, dtype=torch.float64, generator=generator)
    world = rotate(attitude, vector)
    in_ned = rotate(
        coordinates.ned_attitude_from_world(attitude), coordinates.frd_from_body(vector)
    )
    torch.testing.assert_close(in_ned, coordinates.ned_from_world(world))
    in_enu = rotate(coordinates.enu_attitude_from_world(attitude), vector)
    torch.testing.assert_close(in_enu, coordinates.enu_from_world(world))
    there = coordinates.enu_attitude_from_world(attitude)
    torch.testing.assert_close(coordinates.world_attitude_from_enu(there), attitude)


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
def test_headings_are_degrees_clockwise_and_yaws_radians_to_the_left(kind):
    yaw = kind([0.0, math.pi / 2, -math.pi / 4, 3 * math.pi / 2])
    heading = kind([0.0, -90.0, 45.0, 90.0])
    np.testing.assert_allclose(coordinates.heading_from_yaw(yaw), heading, atol=1e-12)
    back = kind([0.0, math.pi / 2, -math.pi / 4, -math.pi / 2])
    np.testing.assert_allclose(coordinates.yaw_from_heading(heading), back, atol=1e-12)
    enu = kind([math.pi / 2, -math.pi, math.pi / 4, 0.0])
    np.testing.assert_allclose(coordinates.enu_yaw_from_yaw(yaw), enu, atol=1e-12)
    np.testing.assert_allclose(coordinates.yaw_from_enu_yaw(enu), back, atol=1e-12)


def test_headings_and_yaws_stay_in_one_turn():
    assert coordinates.heading_from_yaw(np.array([math.pi, -math.pi])).tolist() == [180.0, 180.0]
    assert coordinates.yaw_from_heading(np.array([180.0, -180.0])).tolist() == [-math.pi, -math.pi]


def test_a_heading_is_that_of_the_attitude():
    attitude = coordinates.ned_attitude_from_world(turned("yaw", torch.tensor([-30.0, 100.0])))
    clockwise = 2 * torch.rad2deg(torch.atan2(attitude[:, 3], attitude[:, 0]))
    yaw = torch.deg2rad(torch.tensor([-30.0, 100.0], dtype=torch.float64))
    torch.testing.assert_close(clockwise, torch.tensor([30.0, -100.0], dtype=torch.float64))
    torch.testing.assert_close(coordinates.heading_from_yaw(yaw), clockwise)


def test_vectors_along_the_axes_of_a_turned_body():
    """A body that looks to the left has north on its right."""
    left = torch.tensor([[HALF, 0.0, 0.0, HALF]], dtype=torch.float64)
    north = torch.tensor([[1.0, 0.0, 0.0]], dtype=torch.float64)
    right = torch.tensor([[0.0, -1.0, 0.0]], dtype=torch.float64)
    torch.testing.assert_close(coordinates.body_from_world(left, north), right)
    torch.testing.assert_close(coordinates.world_from_body(left, right), north)


def test_single_precision_stays_single():
    assert coordinates.ned_from_world(np.ones(3, dtype=np.float32)).dtype == np.float32
    assert coordinates.enu_attitude_from_world(torch.ones(4)).dtype == torch.float32
