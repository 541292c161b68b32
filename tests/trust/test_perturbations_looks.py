import dataclasses

import pytest
import torch

from drone_rl.config import MINIMAL
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.perturbations import (
    elevation,
    expose,
    fog,
    scene_appearance,
    sun_at,
    tint,
    whiten,
)
from drone_rl.utils.errors import InputError

PLAIN = Appearance(
    colors={SemanticClass.TARGET: (0.8, 0.1, 0.0), SemanticClass.SKY: (0.6, 0.7, 0.9)},
    ambient=(0.3, 0.3, 0.3),
    sun=(0.7, 0.7, 0.7),
    sun_direction=(3.0, -4.0, -12.0),
)
NONE = torch.zeros(2, 0)


def test_each_world_is_tinted_in_its_own_way_and_no_farther_than_black_and_white():
    sway = torch.tensor([[1.0, -1.0, 1.0], [-0.5, 0.0, 1.0]], dtype=torch.float64)
    made = tint((SemanticClass.TARGET, SemanticClass.OBSTACLE), 0.3).change(PLAIN, sway)
    expected = torch.tensor([[1.0, 0.0, 0.3], [0.65, 0.1, 0.3]], dtype=torch.float64)
    torch.testing.assert_close(made.colors[SemanticClass.TARGET], expected)
    assert made.colors[SemanticClass.SKY] == PLAIN.colors[SemanticClass.SKY]
    assert SemanticClass.OBSTACLE not in made.colors


def test_white_is_mixed_in():
    made = whiten((SemanticClass.TARGET,), 0.5).change(PLAIN, NONE)
    assert made.colors[SemanticClass.TARGET].tolist() == pytest.approx([0.9, 0.55, 0.5])


def test_the_sun_sinks_where_it_stood():
    made = sun_at(30.0).change(PLAIN, NONE).sun_direction
    assert made.tolist() == pytest.approx([0.6 * 3**0.5 / 2, -0.8 * 3**0.5 / 2, -0.5])
    assert elevation(made) == pytest.approx(30.0)
    assert elevation(sun_at(0.0).change(PLAIN, NONE).sun_direction) == pytest.approx(0.0)


def test_exposure_multiplies_what_there_was_and_fog_is_as_told():
    assert expose(2.0).change(PLAIN, NONE).exposure == 2.0
    assert expose(2.0).change(dataclasses.replace(PLAIN, exposure=0.75), NONE).exposure == 1.5
    assert fog(40.0).change(PLAIN, NONE).fog_visibility == 40.0


def test_the_look_of_a_scene_is_all_given_and_draws_the_same():
    worlds = Worlds(1, num_shards=1)
    look = scene_appearance(worlds.scene)
    assert elevation(look.sun_direction) == pytest.approx(MINIMAL.sun_elevation, abs=0.05)
    drawn = worlds.render(worlds.state).clone()
    assert torch.equal(worlds.render(worlds.state, appearance=look), drawn)
    worlds.close()


def test_classes_of_several_colors_stay_as_they_are():
    worlds = Worlds(1, task="pillars", num_shards=1)
    geoms = worlds.scene.geoms(SemanticClass.OBSTACLE)
    assert SemanticClass.OBSTACLE in scene_appearance(worlds.scene).colors
    worlds.scene.model.geom_rgba[geoms[0], :3] = (0.1, 0.2, 0.3)
    look = scene_appearance(worlds.scene)
    assert SemanticClass.OBSTACLE not in look.colors and SemanticClass.SKY in look.colors
    with pytest.raises(InputError, match="the task has no objects of one color"):
        whiten([SemanticClass.OBSTACLE], 0.5).change(look, NONE)
    worlds.close()
