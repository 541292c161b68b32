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
    # 1 m north, 2 m west, 3 m up is 2 m on the other side of east.
    (coordinates.enu_from_world, None, [1.0, 2.0, 3.0], [-2.0, 1.0, 3.0]),
    (coordinates.frd_from_body, None, [0.1, 0.2, -0.3], [0.1, -0.2, 0.3]),
]
NED = (coordinates.ned_attitude_from_world, coordinates.ned_attitude_from_world)
ATTITUDES = [
    # A quarter turn to the left: the nose points west, a quarter turn anticlockwise from above.
    (*NED, (HALF, 0.0, 0.0, HALF), (HALF, 0.0, 0.0, -HALF)),
    # A quarter turn about the axis between forward and left; in NED, left is minus y.
    (*NED, (HALF, 0.5, 0.5, 0.0), (HALF, 0.5, -0.5, 0.0)),
]


@pytest.mark.parametrize("kind", KINDS, ids=["numpy", "torch"])
@pytest.mark.parametrize(("there", "back", "ours", "theirs"), VECTORS)
def test_vectors_both_ways(kind, there, back, ours, theirs):
    given, expected = kind([ours, ours]), kind([theirs, theirs])
    assert type(there(given)) is type(given)
    assert (there(given) == expected).all()
    assert back is None or (back(expected) == given).all()
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


def test_vectors_along_the_axes_of_a_turned_body():
    """A body that looks to the left has north on its right."""
    left = torch.tensor([[HALF, 0.0, 0.0, HALF]], dtype=torch.float64)
    north = torch.tensor([[1.0, 0.0, 0.0]], dtype=torch.float64)
    right = torch.tensor([[0.0, -1.0, 0.0]], dtype=torch.float64)
    torch.testing.assert_close(coordinates.body_from_world(left, north), right)


def test_single_precision_stays_single():
    assert coordinates.ned_from_world(np.ones(3, dtype=np.float32)).dtype == np.float32
    assert coordinates.ned_attitude_from_world(torch.ones(4)).dtype == torch.float32
