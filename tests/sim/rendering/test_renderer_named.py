import pytest

from drone_rl.sim.rendering import Raytracer, find_renderer
from drone_rl.sim.rendering.mujoco_warp import WarpRenderer
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


def test_each_name_stands_for_a_renderer():
    assert find_renderer("raytrace") is Raytracer
    assert find_renderer("mujoco_warp") is WarpRenderer


def test_what_makes_one_stands_for_itself():
    assert find_renderer(WarpRenderer) is WarpRenderer


def test_worlds_are_drawn_by_our_own_unless_another_is_asked_for():
    for options, kind in (({}, Raytracer), ({"renderer": "mujoco_warp"}, WarpRenderer)):
        worlds = Worlds(1, **options)
        assert isinstance(worlds.renderer, kind)
        worlds.close()


def test_an_unknown_name_is_refused_before_anything_is_drawn():
    message = "renderer='opengl' is unknown; give one of: raytrace, mujoco_warp"
    with pytest.raises(InputError, match=message):
        find_renderer("opengl")
    with pytest.raises(InputError, match=message):
        Worlds(1, renderer="opengl")
