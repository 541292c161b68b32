"""Appearances in dm_control: the model and its images."""

import dataclasses

import numpy as np
import pytest
import torch

from benchmarks import speed
from drone_rl.config import AppearanceSettings, CameraSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.opengl import apply_fog
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.textures import load
from drone_rl.utils.seeding import world_random_state

BLOCKS = dataclasses.replace(
    speed.BLOCKS,
    camera_turn=((-3.0, -3.0, -3.0), (3.0, 3.0, 3.0)),
    camera_widening=(-5.0, 5.0),
)
"""The appearance of conf/appearance/blocks.yaml with a random camera."""


def test_model_has_the_sampled_appearance():
    env = make_environment(pixels=False, random_state=world_random_state(0, 0), appearance=BLOCKS)
    worlds = DroneEnv(1, appearance=BLOCKS, pixels=False)
    look = None
    for _ in range(2):
        env.reset()
        worlds.start()
        look = worlds.appearances.current()
        model = env.physics.model
        places = worlds.worlds.poses(worlds.worlds.state, look).props[0].numpy()
        np.testing.assert_allclose(env.physics.data.mocap_pos, places, atol=1e-9)
    assert look is not None
    geoms = env.task.compile().geoms(SemanticClass.DISTRACTOR)
    sizes = model.geom_size[geoms, 0]
    np.testing.assert_allclose(sizes, look.distractors.sizes[0] / 2)
    np.testing.assert_allclose(model.geom_rgba[geoms, :3], look.distractors.colors[0], atol=1e-6)
    np.testing.assert_allclose(model.light_dir[0], look.sun_direction[0], atol=1e-9)
    assert model.light_castshadow[0] and model.vis.headlight.ambient[0] == pytest.approx(0.42)
    camera = model.name2id("drone/front_center", "camera")
    own = CameraSettings().vertical_fov
    half = np.tan(np.radians([model.cam_fovy[camera], own]) / 2)
    assert half[1] / half[0] == pytest.approx(float(look.camera.zoom[0]))
    worlds.close()


def test_minimal_appearance_keeps_the_model():
    plain, minimal = (
        make_environment(pixels=False, appearance=look, random_state=0)
        for look in (None, AppearanceSettings())
    )
    assert plain.task.root_entity.mjcf_model.to_xml_string() == (
        minimal.task.root_entity.mjcf_model.to_xml_string()
    )


def test_fog_matches_hand_computed_colors():
    look = Appearance(colors={SemanticClass.SKY: (1.0, 0.0, 0.0)}, fog_visibility=10.0)
    image = np.full((1, 1, 3), 100, np.uint8)
    for depth, share in ((0.0, 0.0), (10.0, 0.95), (5.0, 1 - 0.05**0.5), (90.0, 0.0)):
        fogged = apply_fog(image, np.full((1, 1), depth), look, 90.0, 80.0)
        wanted = 100 + share * (np.array([255, 0, 0]) - 100)
        assert np.abs(fogged[0, 0] - wanted).max() <= 1
    assert apply_fog(image, np.ones((1, 1)), Appearance(), 90.0, 80.0) is image


def inner(mask):
    """Remove the pixels along the edges."""
    around = (np.roll(mask, by, axis) for by in (-1, 1) for axis in (0, 1))
    return np.logical_and.reduce([mask, *around])


@pytest.mark.render
def test_images_of_blocks_agree_with_the_ray_tracer(egl):
    """Mean colors differ by at most 4 of 255 in each class without edges, and by 5 overall."""
    camera = CameraSettings(width=240, height=120, horizontal_fov=100.0)
    env = make_environment(camera=camera, random_state=world_random_state(0, 0), appearance=BLOCKS)
    ours = DroneEnv(1, camera=camera, appearance=BLOCKS)
    worlds, timestep = ours.worlds, env.reset()
    ours.reset()
    for action in (0, 0, 1, 0):
        view = worlds.view(modality=("rgb", "segmentation"))
        images = worlds.render_all(worlds.state, view, ours.appearances.current())
        traced, seen = (images[name][0, 0].numpy() for name in view.modalities)
        drawn = timestep.observation["drone/front_center"].astype(int)
        assert np.abs(traced - drawn).mean() < 5
        for geom in np.unique(seen):
            pixels = inner(seen == geom)
            if pixels.sum() >= 100:
                difference = traced[pixels].mean(0) - drawn[pixels].mean(0)
                assert np.abs(difference).max() < 4, (geom, difference)
        timestep = env.step(action)
        worlds.step(torch.arange(1), torch.tensor([action]))
    ours.close()


def test_fog_grows_with_the_distance_along_each_ray():
    """Two rows of four pixels, 90 degrees high: rays through (+-1.5, +-0.5) and (+-0.5, +-0.5)."""
    look = Appearance(
        colors={SemanticClass.SKY: (0.5, 0.5, 0.5)}, fog_visibility=10.0, exposure=2.0
    )
    fogged = apply_fog(np.zeros((2, 4, 3), np.uint8), np.full((2, 4), 5.0), look, 90.0, 80.0)
    near, far = (int(255 * (1 - 0.05 ** (0.5 * d**0.5))) for d in (1.5, 3.5))
    assert fogged[..., 0].tolist() == [[far, near, near, far]] * 2
    narrow = apply_fog(np.zeros((2, 4, 3), np.uint8), np.full((2, 4), 5.0), look, 53.13010235, 80.0)
    near, far = (int(255 * (1 - 0.05 ** (0.5 * (1 + d / 4) ** 0.5))) for d in (0.5, 2.5))
    assert np.abs(narrow[0, :2, 0] - np.array([far, near])).max() <= 1


@pytest.mark.parametrize(("texture", "size", "repeat"), [("grid", 4.0, 0.25), (None, None, 1.0)])
def test_ground_tiles_have_the_configured_size(texture, size, repeat):
    own = {} if texture is None else {"ground_texture": texture, "ground_tile": size}
    look = AppearanceSettings(sun_elevation=40.0, **own)
    env = make_environment(pixels=False, random_state=0, appearance=look)
    env.reset()
    model = env.physics.model
    number = model.name2id("ground", "material")
    assert model.mat_texrepeat[number].tolist() == [repeat, repeat]
    start = model.tex_adr[model.name2id("ground", "texture")]
    texels = model.tex_data[start : start + 3 * 256 * 256].reshape(256, 256, 3)
    assert np.array_equal(texels, np.full_like(texels, 255) if texture is None else load(texture))
