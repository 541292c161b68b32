"""Rendering of any state, and the labels of its pixels."""

import torch

from drone_rl.config import ActionSettings, CameraSettings
from drone_rl.envs import (
    ChromaticityPixels,
    CropRows,
    DroneEnv,
    GrayPixels,
    Resize,
    RgbPixels,
)
from drone_rl.explanations.scenes import (
    Region,
    Scenes,
    alternatives,
    place_target,
)
from tests.second_dynamics import Turning


def test_observations_are_those_of_the_environment(world, scenes):
    state = world[0].reset()
    torch.testing.assert_close(scenes.observe(scenes.worlds.state), state["pixels"])


def test_a_cube_on_the_left_is_on_the_left_of_the_picture(scenes):
    regions = scenes.regions(place_target(scenes, torch.tensor([6.0]), torch.tensor([4.0])))[0]
    columns = (regions == Region.NEXT_TARGET).nonzero()[:, 1]
    assert len(columns) and columns.max() < 32


def test_regions_of_a_frame(scenes, world):
    world[0].reset()
    regions = scenes.regions(scenes.worlds.state)
    assert {Region.NEXT_TARGET, Region.HORIZON, Region.GROUND, Region.SKY} <= set(
        regions.unique().tolist()
    )
    rows = (regions[0] == Region.HORIZON).nonzero()[:, 0]
    assert len(rows.unique()) == 2 and set(rows.tolist()) <= {11, 12, 13}  # the middle of 25 rows


def test_maps_return_to_the_frame_of_the_camera():
    env = DroneEnv(
        1,
        camera=CameraSettings(width=64, height=36),
        transforms=[GrayPixels(), CropRows(6, 30), Resize(height=12, width=32)],
    )
    maps = Scenes(env).to_frame(torch.ones(2, 12, 32))
    assert maps.shape == (2, 36, 64)
    assert maps[:, :6].sum() == 0 and maps[:, 30:].sum() == 0
    assert (maps[:, 6:30] == 1).all()
    env.close()


def test_channels_by_transform(scenes):
    assert scenes.channels == "gray"
    for pipeline, channels in (
        ([RgbPixels()], "rgb"),
        ([RgbPixels(), ChromaticityPixels()], "chromaticity"),
    ):
        env = DroneEnv(1, transforms=pipeline)
        assert Scenes(env).channels == channels
        env.close()


def test_the_needed_action_is_known_for_the_default_actions(scenes):
    left = torch.tensor([[9.0, 4.0, 0.0]])
    assert scenes.needed(left).tolist() == [1]
    for how, needed in (
        ({"dynamics": Turning()}, -1),
        ({"actions": ActionSettings(kind="moves_turning")}, 1),  # it turns left
        ({"actions": ActionSettings(kind="moves_full")}, 1),
    ):
        env = DroneEnv(1, transforms=[GrayPixels()], **how)
        assert Scenes(env).needed(left).tolist() == [needed]
        env.close()


def test_alternatives_of_a_scene(scenes, world):
    state = world[0].base_env.worlds.state
    world[0].reset()
    state = scenes.worlds.state
    before = state.present.clone()
    found = alternatives(scenes, state)
    assert list(found) == [
        "no objects", "objects elsewhere 0", "objects elsewhere 1", "objects elsewhere 2",
        "darker", "brighter",
    ]  # fmt: skip
    x = scenes.observe(state)
    torch.testing.assert_close(found["no objects"], scenes.absent.expand_as(x))
    assert (found["darker"][:, 0, -1] < x[:, 0, -1]).all()  # the ground
    assert (found["darker"][:, 0, 0] < x[:, 0, 0]).all()  # the sky
    assert (found["brighter"][:, 0, -1] > x[:, 0, -1]).all()
    assert not torch.equal(found["objects elsewhere 0"], found["objects elsewhere 1"])
    assert torch.equal(state.present, before)
    torch.testing.assert_close(scenes.observe(state), x)  # the worlds are as they were
    again = alternatives(scenes, state)
    assert all(torch.equal(found[name], again[name]) for name in found)
