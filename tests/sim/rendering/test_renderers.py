"""Tests that every built-in renderer must pass."""

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.envs import GrayPixels
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.entities import CHASE, DRONE_CAMERAS, FLOOR_COLOR
from drone_rl.sim.rendering import Appearance, Raytracer
from drone_rl.sim.rendering.mujoco_warp import WarpRenderer
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state


@pytest.fixture(scope="module", params=[Raytracer, WarpRenderer], ids=lambda kind: kind.__name__)
def renderer(request):
    return request.param


@pytest.fixture(scope="module")
def worlds(renderer):
    worlds = Worlds(3, renderer=renderer)
    worlds.reset(torch.arange(3), [world_random_state(0, i) for i in range(3)])
    yield worlds
    worlds.close()


def names_seen(worlds, segmentation):
    model = worlds.scene.model
    return {model.geom(int(i)).name for i in segmentation.unique() if i >= 0}


def test_images_do_not_depend_on_the_batch(worlds):
    together = worlds.render(worlds.state)
    assert together.shape == (3, 25, 64, 3)
    assert together.dtype == torch.uint8
    for i in range(3):
        alone = worlds.render(worlds.state[torch.tensor([i])])
        assert torch.equal(alone[0], together[i])


def test_shards_render_the_same_images(worlds, renderer):
    single = Worlds(3, num_shards=1, renderer=renderer)
    double = Worlds(3, num_shards=2, renderer=renderer)
    assert torch.equal(single.render(worlds.state), double.render(worlds.state))
    single.close()
    double.close()


def test_depth_of_the_cube_ahead(worlds):
    state = worlds.state[torch.tensor([0])]
    state.places[0, :, 1] = 0.0
    depth = worlds.render(state, worlds.view(modality="depth"))
    # the camera is 0.4 m ahead of the drone's center, the front face 1.25 m before the cube's
    assert depth[0, 12, 32].item() == pytest.approx(15.0 - 1.25 - 0.4, abs=1e-3)
    assert depth[0, 0, 0].item() == 0.0  # sky


@pytest.mark.parametrize("camera", [c.name for c in (*DRONE_CAMERAS, CHASE)])
def test_every_camera_is_available(worlds, camera):
    image = worlds.render(worlds.state, worlds.view(camera, height=20, width=30))
    assert image.shape == (3, 20, 30, 3)


def test_joint_call_equals_separate_calls(worlds):
    cameras, modalities = ("bottom_center", "chase", "front_left"), ("segmentation", "gray", "rgb")
    images = worlds.render_all(worlds.state, worlds.view(cameras, modalities, 20, 30))
    assert list(images) == list(modalities)
    assert images["rgb"].shape == (3, 3, 20, 30, 3)
    for i, camera in enumerate(cameras):
        for modality, several in images.items():
            alone = worlds.render(worlds.state, worlds.view(camera, modality, 20, 30))
            assert torch.equal(several[:, i], alone), (camera, modality)


def test_gray_equals_the_transform_of_rgb_bit_for_bit(worlds):
    draw = torch.Generator().manual_seed(0)
    several = {m: torch.rand(60, 3, generator=draw) for m in SemanticClass}
    states = worlds.state[torch.arange(60) % 3]
    view = worlds.view(modality=("rgb", "gray"))
    for appearance in (None, Appearance(colors=several)):
        images = worlds.render_all(states, view, appearance)
        expected = GrayPixels()._apply_transform(images["rgb"])
        assert torch.equal(images["gray"], expected[:, :, 0])


def test_drone_is_visible_only_to_the_chase_camera(worlds):
    view = worlds.view(CHASE.name, "segmentation", 40, 60, show_drone=True)
    assert "drone/hull" in names_seen(worlds, worlds.render(worlds.state, view))
    own = worlds.render(worlds.state, worlds.view("bottom_center", "segmentation"))
    assert names_seen(worlds, own) == {"floor"}


def test_invalid_views_raise(worlds):
    with pytest.raises(InputError, match="choose from"):
        worlds.render(worlds.state, worlds.view("no_such_camera"))
    with pytest.raises(InputError, match="segmentation or normals"):
        worlds.view(modality="heat")
    with pytest.raises(InputError, match="is more than one image; call render_all"):
        worlds.render(worlds.state, worlds.view(modality=("rgb", "depth")))


@pytest.fixture
def ahead(worlds):
    """Return two environments, each with a cube in front of the camera."""
    state = worlds.state[torch.tensor([0, 0])]
    state.places[:, 0, 1] = 0.0
    return state


def regions(worlds, state):
    """Return masks of sky, ground and cubes."""
    seen = worlds.render(state, worlds.view(modality="segmentation"))
    semantic_class = torch.tensor([*worlds.scene.semantic_classes, SemanticClass.SKY])[seen]
    return [
        semantic_class == m for m in (SemanticClass.SKY, SemanticClass.GROUND, SemanticClass.TARGET)
    ]


def test_appearance_colors_only_the_named_classes(worlds, ahead):
    plain, areas = worlds.render(ahead), regions(worlds, ahead)
    assert all(area.any() for area in areas)
    for semantic_class, area in zip(
        (SemanticClass.SKY, SemanticClass.GROUND, SemanticClass.TARGET), areas, strict=True
    ):
        other = worlds.render(
            ahead, appearance=Appearance(colors={semantic_class: (0.1, 0.3, 0.05)})
        )
        assert torch.equal((other != plain).any(-1), area), semantic_class
    assert torch.equal(worlds.render(ahead), plain)  # and the next image is unaffected


def test_sky_has_the_exact_color(worlds, ahead):
    image = worlds.render(ahead, appearance=Appearance(colors={SemanticClass.SKY: (0.2, 0.5, 1.0)}))
    assert image[:, 0].unique(dim=1).tolist() == [[[51, 127, 255]]] * 2


def test_each_environment_can_have_its_own_appearance(worlds, ahead):
    """This includes more states than environments, and all parts of the batch."""
    grounds = torch.tensor([[0.2, 0.2, 0.2], [0.8, 0.1, 0.1]])
    skies = torch.tensor([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    rows, first = torch.tensor([0, 1, 1, 0, 1]), ahead[torch.tensor([0])]
    alone = []
    for ground, sky in zip(grounds.tolist(), skies.tolist(), strict=True):
        appearance = Appearance(
            colors={SemanticClass.GROUND: tuple(ground), SemanticClass.SKY: tuple(sky)}
        )
        alone.append(worlds.render(first, appearance=appearance)[0])
    assert not torch.equal(*alone)
    appearance = Appearance(
        colors={SemanticClass.GROUND: grounds[rows], SemanticClass.SKY: skies[rows]}
    )
    together = worlds.render(ahead[torch.zeros(5, dtype=torch.int64)], appearance=appearance)
    assert torch.equal(together, torch.stack(alone)[rows])


def test_lights_can_differ_by_environment(worlds, ahead):
    """With ambient light only, a color is scaled by its strength."""
    dark = torch.tensor([[0.0, 0.0, 0.0]] * 2)
    shine = torch.tensor([[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]])
    image = worlds.render(ahead, appearance=Appearance(ambient=shine, sun=dark))
    _, ground, cube = (area[0] for area in regions(worlds, ahead))
    for world, strength in enumerate((1.0, 0.5)):
        for area, color in ((ground, FLOOR_COLOR), (cube, TaskSettings().cube_color)):
            shown = image[world][area].unique(dim=0)
            assert len(shown) == 1
            expected = strength * 255 * torch.tensor(color)
            torch.testing.assert_close(shown[0].float(), expected, atol=1.0, rtol=0)
    low = worlds.render(ahead, appearance=Appearance(sun_direction=(1.0, 0.0, -0.1)))
    high = worlds.render(ahead, appearance=Appearance(sun_direction=(0.0, 0.0, -9.0)))
    assert (low[0][ground] < high[0][ground]).all()  # the ground is lit from above
    assert low[0][cube].float().mean() > high[0][cube].float().mean()  # its front is not


@pytest.mark.render
def test_images_agree_with_opengl(egl, renderer):
    """Images of the same poses differ only at edges, where OpenGL blends samples."""
    camera = CameraSettings(width=256, height=100)
    env = make_environment(camera=camera, random_state=world_random_state(0, 0))
    worlds = Worlds(1, camera=camera, renderer=renderer)
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    timestep = env.reset()
    for action in (0, 0, 1, 0, 2, 2, 0, 0, 0, 0, 0, 0):
        traced = worlds.render(worlds.state)[0].numpy().astype(int)
        drawn = timestep.observation["drone/front_center"].astype(int)
        difference = np.abs(traced - drawn).max(-1)
        assert np.median(difference) <= 2
        assert (difference > 8).mean() < 0.04  # edges and the haze of the horizon
        timestep = env.step(action)
        worlds.step(torch.arange(1), torch.tensor([action]))
    worlds.close()
