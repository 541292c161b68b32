import pytest

from drone_rl.config.camera import RENDERERS, RendererName
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


class Some(Settings):
    renderer: RendererName = "raytrace"


def test_a_setting_chooses_one_by_name():
    assert [Some(renderer=name).renderer for name in RENDERERS] == ["raytrace", "mujoco_warp"]
    with pytest.raises(InputError, match="renderer"):
        Some(renderer="opengl")
