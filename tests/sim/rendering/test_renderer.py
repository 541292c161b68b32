"""The choice of a renderer, and a user-defined one of one color."""

import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.explanations.scenes import Scenes, place_target
from drone_rl.sim.rendering import Appearance, Raytracer
from drone_rl.sim.rendering.mujoco_warp import WarpRenderer
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import to_gray
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


class OneColor:
    """Render all pixels in the color of the sky, as RGB or gray."""

    def __init__(self, scene, *, num_envs, num_shards, device):
        self.scene, self.prepared, self.is_closed = scene, [], False

    def prepare(self, view):
        view.check_modalities(self, {"rgb", "gray"})
        self.prepared.append(view)

    def render(self, view, poses, appearance=None):
        self.prepare(view)
        color = self.scene.sky
        if appearance is not None:
            color = appearance.colors.get(SemanticClass.SKY, color)
        pixels = (torch.tensor(color) * 255).to(torch.uint8)
        images = view.new_images(len(poses))
        for modality, image in images.items():
            image[:] = to_gray(pixels) if modality == "gray" else pixels
        return images

    def close(self):
        self.is_closed = True


def test_worlds_use_a_custom_renderer():
    worlds = Worlds(2, renderer=OneColor)
    pixels = worlds.render(worlds.state)
    assert pixels.shape == (2, 25, 64, 3)
    assert pixels.unique(dim=-2).flatten(0, -2).unique(dim=0).tolist() == [[158, 188, 234]]
    red = worlds.render(worlds.state, appearance=Appearance(colors={SemanticClass.SKY: (1, 0, 0)}))
    assert red[0, 0, 0].tolist() == [255, 0, 0]


def test_unsupported_view_raises_one_line():
    worlds = Worlds(2, renderer=OneColor)
    with pytest.raises(
        InputError, match="modality='depth' can't be rendered by OneColor; give one of: rgb, gray"
    ):
        worlds.render(worlds.state, worlds.view(modality="depth"))


def test_environment_uses_and_closes_the_renderer():
    env = DroneEnv(3, renderer=OneColor)
    check_env_specs(env)
    renderer = env.worlds.renderer
    assert renderer.prepared[0] == env.worlds.policy_view
    env.close()
    assert renderer.is_closed


def test_explanations_use_its_images():
    env = DroneEnv(2, renderer=OneColor, transforms=[GrayPixels(), StandardizePixels()])
    scenes = Scenes(env)
    seen = scenes.observe(place_target(scenes, torch.tensor([5.0, 9.0]), torch.zeros(2)))
    assert seen.shape == (2, 1, 25, 64) and len(seen.unique()) == 1
    env.close()


def test_default_renderer_is_the_ray_tracer():
    for options, kind in (({}, Raytracer), ({"renderer": "mujoco_warp"}, WarpRenderer)):
        worlds = Worlds(1, **options)
        assert isinstance(worlds.renderer, kind)
        worlds.close()
