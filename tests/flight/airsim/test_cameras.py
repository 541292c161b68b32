"""Mounted cameras: poses and fields of view, by hand."""

import math

import pytest
import torch

from drone_rl.flight.airsim.cameras import make_cameras
from drone_rl.flight.airsim.settings_file import CameraChoice, Capture
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.rendering.appearance import rotate
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
        x=0.0,
        y=0.0,
        z=0.1,
        pitch=-90.0,
    )
    torch.testing.assert_close(same, down, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(
    ("camera", "angles", "ahead"),
    [
        ("bottom_center", {"yaw": 90.0}, (0.0, 0.0, -1.0)),
        ("bottom_center", {"pitch": -45.0}, (math.sqrt(0.5), 0.0, -math.sqrt(0.5))),
        ("back_center", {"pitch": -45.0}, (-math.sqrt(0.5), 0.0, -math.sqrt(0.5))),
        ("front_center", {"yaw": 90.0}, (0.0, -1.0, 0.0)),
    ],
)
def test_angles_that_are_not_given_stay(camera, angles, ahead):
    made = make_cameras({}, {camera: CameraChoice(**angles)})[camera]
    forward = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)
    assert rotate(made.attitude, forward).tolist() == pytest.approx(ahead, abs=1e-9)
    assert made.capture(ImageType.SCENE) == Capture()


def test_a_camera_without_settings_is_that_of_the_model():
    for camera in make_cameras({}, {}).values():
        vertical = 2 * math.degrees(math.atan(144 / 256))
        assert camera.mounting(Capture(), vertical) is None


def test_a_wider_camera_sees_the_same_pixel_closer_to_the_middle(cubes):
    cubes.reset()
    capture = {"ImageType": 1, "Width": 32, "Height": 18, "FOV_Degrees": 120.0}
    wide = {"capture_settings": [capture]}
    narrow = look(cubes, kind=ImageType.DEPTH_PLANAR)
    broad = look(cubes, kind=ImageType.DEPTH_PLANAR, **wide)
    # the lowest row looks down steeper with the wider view, so the ground there is nearer
    assert float(broad[-1, 16]) < float(narrow[-1, 16])
    half = math.tan(math.radians(45.0)) * 9 / 16 * (17.5 - 8.5) / 9
    assert float(narrow[-1, 16]) == pytest.approx(2.5 / half, rel=0.06)
