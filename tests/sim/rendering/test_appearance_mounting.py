"""Hand-computed position and direction of cameras."""

import math

import pytest
import torch

from drone_rl.sim.rendering.appearance import Mounting, moved, product, rotate, turned, zoom_for_fov

AHEAD = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)
HERE = torch.zeros(1, 3, dtype=torch.float64)


def test_quaternion_product_composes_rotations():
    yaw = turned("yaw", 90.0)[None]
    torch.testing.assert_close(
        product(yaw, yaw), torch.tensor([[0.0, 0.0, 0.0, 1.0]], dtype=torch.float64)
    )
    assert rotate(yaw, AHEAD)[0].tolist() == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("axis", "degrees", "there"),
    [
        ("yaw", 90.0, (0.0, 1.0, 0.0)),  # to the left
        ("pitch", 30.0, (math.cos(math.pi / 6), 0.0, -0.5)),  # down
        ("roll", 45.0, (1.0, 0.0, 0.0)),
    ],
)
def test_direction_of_a_rotated_camera(axis, degrees, there):
    assert rotate(turned(axis, degrees), AHEAD).tolist() == pytest.approx(there)
    several = turned(axis, torch.tensor([degrees, -degrees]))
    assert several.shape == (2, 4) and torch.equal(several[0, :1], several[1, :1])


def test_mountings_compose():
    left = moved(None, HERE, turned("yaw", 90.0)[None])
    assert torch.as_tensor(left.offset).tolist() == [[0.0, 0.0, 0.0]]
    both = moved(left, 2.0 * AHEAD[None], turned("yaw", 90.0)[None])
    assert both.offset.tolist()[0] == pytest.approx([0.0, 2.0, 0.0])  # ahead of the camera
    assert rotate(both.turn, AHEAD)[0].tolist() == pytest.approx([-1.0, 0.0, 0.0])
    assert both.camera == Mounting().camera and both.zoom is None


def test_zoom_decreases_with_the_field_of_view():
    assert zoom_for_fov(90.0, torch.tensor([90.0, 120.0])).tolist() == pytest.approx([1.0, 3**-0.5])
