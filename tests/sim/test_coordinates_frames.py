import math

import numpy as np
import pytest
import torch

from drone_rl.sim import coordinates
from drone_rl.sim.rendering.appearance import rotate

HALF = math.sqrt(0.5)
KINDS = [np.array, lambda rows: torch.tensor(rows, dtype=torch.float64)]
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


def test_single_precision_is_kept():
    assert coordinates.ned_from_world(np.ones(3, dtype=np.float32)).dtype == np.float32
    assert coordinates.ned_attitude_from_world(torch.ones(4)).dtype == torch.float32
