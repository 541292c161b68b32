import pytest

from drone_rl.sim.rendering import Raytracer, find_renderer
from drone_rl.sim.rendering.mujoco_warp import WarpRenderer
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


def test_names_select_renderers():
    assert find_renderer("raytrace") is Raytracer
    assert find_renderer("mujoco_warp") is WarpRenderer


def test_renderer_classes_are_returned_unchanged():
    assert find_renderer(WarpRenderer) is WarpRenderer


def test_default_renderer_is_the_ray_tracer():
    for options, kind in (({}, Raytracer), ({"renderer": "mujoco_warp"}, WarpRenderer)):
        worlds = Worlds(1, **options)
        assert isinstance(worlds.renderer, kind)
        worlds.close()


def test_unknown_name_raises():
    message = "renderer='opengl' is unknown; give one of: raytrace, mujoco_warp"
    with pytest.raises(InputError, match=message):
        find_renderer("opengl")
    with pytest.raises(InputError, match=message):
        Worlds(1, renderer="opengl")
