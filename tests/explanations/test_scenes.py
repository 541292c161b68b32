import torch

from drone_rl.config import AppearanceSettings, CameraSettings
from drone_rl.envs import (
    ChromaticityPixels,
    CropRows,
    DroneEnv,
    GrayPixels,
    Resize,
    RgbPixels,
    with_transforms,
)
from drone_rl.explanations.scenes import Region, Scenes, empty_scene, place_target
from tests.continuous import make_env
from tests.second_dynamics import Turning


def test_a_still_is_what_the_policy_saw(world, scenes):
    state = world[0].reset()
    torch.testing.assert_close(scenes.observe(scenes.worlds.state), state["pixels"])


def test_a_cube_on_the_left_is_on_the_left_of_the_picture(scenes):
    regions = scenes.regions(place_target(scenes, torch.tensor([6.0]), torch.tensor([4.0])))[0]
    columns = (regions == Region.NEXT_TARGET).nonzero()[:, 1]
    assert len(columns) and columns.max() < 32


def test_the_nearest_cube_is_next_and_the_horizon_lies_between(scenes, world):
    world[0].reset()
    regions = scenes.regions(scenes.worlds.state)
    assert {Region.NEXT_TARGET, Region.HORIZON, Region.GROUND, Region.SKY} <= set(
        regions.unique().tolist()
    )
    rows = (regions[0] == Region.HORIZON).nonzero()[:, 0]
    assert len(rows.unique()) == 2 and set(rows.tolist()) <= {11, 12, 13}  # the middle of 25 rows


def test_an_empty_scene_has_no_cube(scenes):
    regions = scenes.regions(empty_scene(scenes))
    assert not ((regions == Region.NEXT_TARGET) | (regions == Region.OTHER_TARGET)).any()


def test_depth_is_the_cubes_distance(scenes):
    state = place_target(scenes, torch.tensor([8.0]), torch.tensor([0.0]))
    # the camera sits 0.4 m ahead of the drone's middle, the cube's face 1.25 m before its own
    torch.testing.assert_close(scenes.depth(state)[0, 12, 32], torch.tensor(8 - 0.4 - 1.25))


def test_maps_go_back_to_where_the_pipeline_took_the_picture_from():
    env = with_transforms(
        DroneEnv(1, camera=CameraSettings(width=64, height=36)),
        [GrayPixels(), CropRows(6, 30), Resize(height=12, width=32)],
    )
    maps = Scenes(env).to_frame(torch.ones(2, 12, 32))
    assert maps.shape == (2, 36, 64)
    assert maps[:, :6].sum() == 0 and maps[:, 30:].sum() == 0
    assert (maps[:, 6:30] == 1).all()
    env.close()


def test_whether_the_channels_are_colors(scenes):
    assert scenes.channels == "gray"
    for pipeline, channels in (
        ([RgbPixels()], "rgb"),
        ([RgbPixels(), ChromaticityPixels()], "chromaticity"),
    ):
        env = with_transforms(DroneEnv(1), pipeline)
        assert Scenes(env).channels == channels
        env.close()


def test_what_is_needed_is_known_of_the_tasks_own_actions_alone(scenes):
    left = torch.tensor([[9.0, 4.0, 0.0]])
    assert scenes.needed(left).tolist() == [1]
    env = with_transforms(DroneEnv(1, dynamics=Turning()), [GrayPixels()])
    assert Scenes(env).needed(left).tolist() == [-1]
    env.close()


def test_what_is_needed_is_the_part_of_the_same_name():
    env, places = make_env(1), torch.tensor([[6.0, y, 0.0] for y in (4.0, 0.0, -4.0)])
    assert Scenes(env).needed(places).tolist() == [1, 0, 2]
    env.close()


def test_distractors_are_no_targets():
    look = AppearanceSettings(distractors=2, distractor_size=8.0, distractor_distance=2.0)
    env = with_transforms(DroneEnv(1, appearance=look), [GrayPixels()])
    scenes = Scenes(env)
    regions = scenes.regions(empty_scene(scenes))
    env.close()
    assert not ((regions == Region.NEXT_TARGET) | (regions == Region.OTHER_TARGET)).any()
