"""A renderer of one colour fits wherever Warp's does."""

import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.explanations.scenes import Scenes, place_target
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


class OneColour:
    """Paints everything in the sky's colour, and knows colours only."""

    def __init__(self, scene, *, num_worlds, num_shards, device):
        self.scene, self.prepared, self.is_closed = scene, [], False

    def prepare(self, view):
        view.check_modalities(self, {"rgb"})
        self.prepared.append(view)

    def render(self, view, poses, appearance=None):
        self.prepare(view)
        color = self.scene.sky
        if appearance is not None:
            color = appearance.colors.get(SemanticClass.SKY, color)
        pixels = (torch.tensor(color) * 255).to(torch.uint8)
        pictures = view.new_images(len(poses))
        pictures["rgb"][:] = pixels
        return pictures

    def close(self):
        self.is_closed = True


def test_worlds_draw_by_it():
    worlds = Worlds(2, renderer=OneColour)
    pixels = worlds.render(worlds.state)
    assert pixels.shape == (2, 25, 64, 3)
    assert pixels.unique(dim=-2).flatten(0, -2).unique(dim=0).tolist() == [[158, 188, 234]]
    red = worlds.render(worlds.state, appearance=Appearance(colors={SemanticClass.SKY: (1, 0, 0)}))
    assert red[0, 0, 0].tolist() == [255, 0, 0]


def test_a_view_that_it_cannot_draw_is_refused_in_one_line():
    worlds = Worlds(2, renderer=OneColour)
    with pytest.raises(
        InputError, match="'depth' can't be drawn by OneColour; ask for one of: rgb"
    ):
        worlds.render(worlds.state, worlds.view(modality="depth"))


def test_the_environment_flies_with_it_and_closes_it():
    env = DroneEnv(3, renderer=OneColour)
    check_env_specs(env)
    renderer = env.worlds.renderer
    assert renderer.prepared[0] == env.worlds.policy_view
    env.close()
    assert renderer.is_closed


def test_explanations_show_the_policy_what_it_paints():
    env = with_transforms(DroneEnv(2, renderer=OneColour), [GrayPixels(), StandardizePixels()])
    scenes = Scenes(env)
    seen = scenes.observe(place_target(scenes, torch.tensor([5.0, 9.0]), torch.zeros(2)))
    assert seen.shape == (2, 1, 25, 64) and len(seen.unique()) == 1
    env.close()
