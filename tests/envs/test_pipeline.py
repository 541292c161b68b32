import torch

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms


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
