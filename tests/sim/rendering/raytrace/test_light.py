"""Materials, textures, lights and shadows of scenes of any geoms, computed by hand."""

import numpy as np
import pytest
import torch

from drone_rl.sim.rendering import Poses, View
from drone_rl.sim.rendering.raytrace.world_renderer import SceneRaytracer
from tests.any_scene import make_scene

DOWN = """<camera name="above" pos="{} {} 4" fovy="1"/>"""
DARK = '<headlight ambient="0 0 0" diffuse="0 0 0" specular="0 0 0"/>'
BRIGHT = '<headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>'
MATT = '<material name="matt" specular="0"/>'


def color_at(place, body, assets=MATT, head=DARK):
    """Return the color that a camera 4 m above a place sees in its middle."""
    scene = make_scene(body + DOWN.format(*place), assets, head)
    renderer = SceneRaytracer(scene, num_envs=1)
    frames = Poses(torch.zeros(1, 3), torch.tensor([[1.0, 0, 0, 0]]), torch.zeros(1, 0, 3))
    view = View(cameras=("above",), height=1, width=1)
    color = renderer.render(view, frames)["rgb"][0, 0, 0, 0].tolist()
    renderer.close()
    return color


FLOOR = '<geom type="plane" size="4 4 .1" material="matt" rgba=".5 .25 1 1"/>'


def test_spot_light_fades_with_distance_and_ends_at_its_cutoff():
    lamp = """<light pos="0 0 2" dir="0 0 -1" cutoff="45" exponent="0" attenuation="1 0 .25"
    diffuse=".8 .8 .8" ambient="0 0 0" castshadow="false"/>"""
    # at 2 m 1 / (1 + 0.25 * 4) = 0.5 of 0.8 arrives: 0.4 of (0.5, 0.25, 1)
    np.testing.assert_allclose(color_at((0, 0), FLOOR + lamp), [51, 25, 102], atol=1)
    # at 1 m to the side, sqrt(5) m away: 1 / 2.25 of 0.8, on a floor that faces it by 2 / sqrt(5)
    expected = 255 * 0.8 / 2.25 * 2 / 5**0.5 * np.array([0.5, 0.25, 1])
    np.testing.assert_allclose(color_at((1, 0), FLOOR + lamp), expected, atol=1.5)
    assert color_at((2.3, 0), FLOOR + lamp) == [0, 0, 0]


def test_point_light_ends_at_its_range():
    lamp = '<light type="point" pos="0 0 2" diffuse="1 1 1" castshadow="false" range="{}"/>'
    assert color_at((0, 0), FLOOR + lamp.format(3))[2] == 255
    assert color_at((0, 0), FLOOR + lamp.format(1)) == [0, 0, 0]


def test_shadow_removes_a_light_with_its_ambient_part():
    sun = """<light type="directional" dir="0 0 -1" diffuse=".4 .4 .4" ambient=".2 .2 .2"
    castshadow="{}"/>"""
    roof = '<geom type="box" size=".5 .5 .1" pos="0 0 5"/>'  # above the camera
    head = '<headlight ambient=".3 .3 .3" diffuse="0 0 0" specular="0 0 0"/>'
    lit, dark, clear = (
        color_at(place, FLOOR + roof + sun.format(casts), head=head)
        for place, casts in (((1, 0), "true"), ((0, 0), "true"), ((0, 0), "false"))
    )
    np.testing.assert_allclose(lit, 255 * 0.9 * np.array([0.5, 0.25, 1]), atol=1)
    np.testing.assert_allclose(dark, 255 * 0.3 * np.array([0.5, 0.25, 1]), atol=1)
    assert clear == lit


@pytest.mark.parametrize(
    ("place", "color"), [((-1, 1), 255), ((1, 1), 51), ((-1, -1), 51), ((1, -1), 255)]
)
def test_texture_lies_on_a_plane_as_in_opengl(place, color):
    assets = """<texture name="t" type="2d" builtin="checker" rgb1="1 1 1" rgb2=".2 .2 .2"
    width="2" height="2"/><material name="matt" texture="t" texrepeat="1 1" specular="0"/>"""
    floor = '<geom type="plane" size="2 2 .1" material="matt"/>'
    np.testing.assert_allclose(color_at(place, floor, assets, BRIGHT), [color] * 3, atol=1)


def test_cube_map_has_a_side_for_each_direction():
    assets = """<texture name="t" type="cube" builtin="gradient" rgb1="0 1 0" rgb2="1 0 0"
    width="8"/><material name="matt" texture="t" specular="0"/>"""
    ball = '<geom type="sphere" size="1" material="matt" euler="{} 0 0"/>'
    assert color_at((0, 0), ball.format(90), assets, BRIGHT)[1] > 240  # its +y is up
    assert color_at((0, 0), ball.format(-90), assets, BRIGHT)[0] > 240


def test_what_is_behind_a_transparent_geom_shows_through():
    # OpenGL blends it twice: 1 - (1 - 0.5)^2 of its own color
    pane = '<geom type="box" size="1 1 .1" pos="0 0 1" rgba="1 0 0 .5"/>'
    floor = '<geom type="plane" size="4 4 .1" rgba="0 0 1 1"/>'
    np.testing.assert_allclose(color_at((0, 0), floor + pane, head=BRIGHT), [191, 0, 63], atol=1)


def test_scene_without_lights_is_dim_and_emission_glows():
    assets = '<material name="matt" emission=".5" specular="0"/>'
    off = '<headlight active="0"/>'
    expected = 255 * (0.3 + 0.5) * np.array([0.5, 0.25, 1])
    np.testing.assert_allclose(color_at((0, 0), FLOOR, assets, off), expected, atol=1)


def test_images_are_those_of_opengl(egl):
    from benchmarks.worlds import strangers

    path = next(path for path in strangers.files() if path.name == "humanoid.xml")
    likeness = strangers.compare(strangers.load_scene(path))
    assert likeness.segmentation < 0.01
    assert likeness.gray > 0.99
