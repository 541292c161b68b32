"""Appearances by environment, and hand-computed poses of cameras."""

import math

import pytest
import torch

from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.appearance import (
    Mounting,
    moved,
    product,
    rotate,
    turned,
    zoom_for_fov,
)
from drone_rl.sim.rendering.scene import SemanticClass

RED = (1.0, 0.0, 0.0)


SEVERAL = torch.tensor([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])


def test_slicing_keeps_shared_values():
    appearance = Appearance(
        colors={SemanticClass.SKY: RED, SemanticClass.TARGET: SEVERAL}, sun=SEVERAL, ambient=RED
    )
    part = appearance[1:3]
    assert part.colors[SemanticClass.SKY] == RED and part.ambient == RED
    assert torch.equal(part.colors[SemanticClass.TARGET], SEVERAL[1:3])
    assert torch.equal(part.sun, SEVERAL[1:3]) and part.sun_direction is None
    assert torch.equal(Appearance(ambient=torch.tensor(RED))[0:1].ambient, torch.tensor(RED))


def test_over_prefers_own_values():
    below = Appearance(
        colors={SemanticClass.SKY: RED, SemanticClass.GROUND: RED}, fog_visibility=50.0, shadows=1
    )
    above = Appearance(colors={SemanticClass.SKY: (0.0, 0.0, 1.0)}, fog_visibility=10.0)
    both = above.over(below)
    assert both.colors == {SemanticClass.SKY: (0.0, 0.0, 1.0), SemanticClass.GROUND: RED}
    assert (both.fog_visibility, both.shadows, both.sun) == (10.0, 1, None)
    assert above.over(None) is above
    assert Appearance(shadows=0).over(below).shadows == 0


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
