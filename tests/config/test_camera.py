import math

import pytest

from drone_rl.config import CameraSettings


def test_vertical_fov_of_square_pixels():
    assert CameraSettings(width=64, height=64, horizontal_fov=90.0).vertical_fov == pytest.approx(
        90
    )
    half = math.degrees(math.atan(math.tan(math.radians(67.5)) * 144 / 256))
    original = CameraSettings(width=256, height=144, horizontal_fov=135.0)
    assert original.vertical_fov == pytest.approx(2 * half)
