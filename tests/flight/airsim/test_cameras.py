"""Mounted cameras: poses and fields of view, by hand."""

import math

import pytest
import torch

from drone_rl.flight.airsim.settings_file import Capture, Offset
from drone_rl.sim.image_types import ImageType
from tests.flight.airsim.looking import look


def test_cameras_look_where_their_poses_say(empty):
    """The ground below a camera at 2.5 m is 2.5 m away for one that looks straight down."""
    down = look(empty, "bottom_center", ImageType.DEPTH_PLANAR, position=(0.0, 0.0, 3.0))
    assert float(down[9, 16]) == pytest.approx(3.0 - 0.1, abs=0.01)
    same = look(
        empty,
        "front_center",
        ImageType.DEPTH_PLANAR,
        position=(0.0, 0.0, 3.0),
        offset=Offset(0.0, 0.0, 0.1, pitch=-90.0),
    )
    torch.testing.assert_close(same, down, rtol=1e-4, atol=1e-4)


def test_a_wider_camera_sees_the_same_pixel_closer_to_the_middle(cubes):
    cubes.reset()
    wide = {"captures": {ImageType.DEPTH_PLANAR: Capture(32, 18, 120.0)}}
    narrow = look(cubes, kind=ImageType.DEPTH_PLANAR)
    broad = look(cubes, kind=ImageType.DEPTH_PLANAR, **wide)
    # the lowest row looks down steeper with the wider view, so the ground there is nearer
    assert float(broad[-1, 16]) < float(narrow[-1, 16])
    half = math.tan(math.radians(45.0)) * 9 / 16 * (17.5 - 8.5) / 9
    assert float(narrow[-1, 16]) == pytest.approx(2.5 / half, rel=0.06)
