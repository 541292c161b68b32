import math

import pytest

from drone_rl.config import CameraSettings
from drone_rl.config.camera import RENDERERS, RendererName
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


def test_vertical_fov_of_square_pixels():
    assert CameraSettings(width=64, height=64, horizontal_fov=90.0).vertical_fov == pytest.approx(
        90
    )
    half = math.degrees(math.atan(math.tan(math.radians(67.5)) * 144 / 256))
    original = CameraSettings(width=256, height=144, horizontal_fov=135.0)
    assert original.vertical_fov == pytest.approx(2 * half)


@pytest.mark.parametrize(
    "change", [{"width": 0}, {"height": 1025}, {"horizontal_fov": 180.0}, {"horizontal_fov": 2.36}]
)
def test_bad_camera_is_refused(change):
    with pytest.raises(InputError, match="it must be a"):
        CameraSettings(**change)


class Some(Settings):
    renderer: RendererName = "raytrace"


def test_a_setting_chooses_one_by_name():
    assert [Some(renderer=name).renderer for name in RENDERERS] == ["raytrace", "mujoco_warp"]
    with pytest.raises(InputError, match="renderer"):
        Some(renderer="opengl")
