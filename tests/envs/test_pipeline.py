import torch
from torchrl.envs import RewardSum

from drone_rl.envs import (
    CropRows,
    DroneEnv,
    GrayPixels,
    StandardizePixels,
    on_pixels,
    with_transforms,
)


def test_transforms_are_applied_in_the_order_given():
    env = with_transforms(DroneEnv(2), [GrayPixels(), StandardizePixels()])
    assert [type(t) for t in env.transform] == [GrayPixels, StandardizePixels]
    pixels = env.reset()["pixels"]
    assert pixels.shape == (2, 1, 25, 64) and pixels.dtype == torch.float32
    env.close()


def test_without_transforms_the_environment_is_as_it_was():
    env = with_transforms(DroneEnv(2))
    assert env.reset()["pixels"].dtype == torch.uint8
    env.close()


def test_pictures_alone_are_transformed_in_order_and_by_those_that_look_at_them():
    white = torch.full((3, 4, 2, 3), 255, dtype=torch.uint8)
    standard = StandardizePixels(mean=0.5, std=0.25)
    made = on_pixels([RewardSum(), GrayPixels(), standard, CropRows(1, 4)])(white)
    torch.testing.assert_close(made, torch.full((3, 1, 3, 2), 2.0))
    assert on_pixels([])(white) is white
