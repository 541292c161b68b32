import pytest
import torch
from torchrl.envs import CatFrames, RewardSum

from drone_rl.envs import (
    CropRows,
    DroneEnv,
    GrayPixels,
    StandardizePixels,
    on_pixels,
    with_transforms,
)
from drone_rl.envs.transforms import apply_to_frames, memory_of


def test_transforms_are_applied_in_order():
    env = with_transforms(DroneEnv(2), [GrayPixels(), StandardizePixels()])
    assert [type(t) for t in env.transform] == [GrayPixels, StandardizePixels]
    pixels = env.reset()["pixels"]
    assert pixels.shape == (2, 1, 25, 64) and pixels.dtype == torch.float32
    env.close()


def test_without_transforms_the_environment_is_unchanged():
    env = with_transforms(DroneEnv(2))
    assert env.reset()["pixels"].dtype == torch.uint8
    env.close()


def test_on_pixels_applies_only_pixel_transforms_in_order():
    white = torch.full((3, 4, 2, 3), 255, dtype=torch.uint8)
    standard = StandardizePixels(mean=0.5, std=0.25)
    made = on_pixels([RewardSum(), GrayPixels(), standard, CropRows(1, 4)])(white)
    torch.testing.assert_close(made, torch.full((3, 1, 3, 2), 2.0))
    assert on_pixels([])(white) is white


def test_film_is_transformed_per_frame_and_stacked():
    standard = StandardizePixels(mean=0.5, std=0.25)
    stack = CatFrames(N=3, dim=-3, in_keys=["pixels"])
    film = [torch.full((2, 1, 2, 2), value) for value in (0.5, 0.75)]
    seen = apply_to_frames([standard, stack], film)
    assert seen.shape == (2, 3, 2, 2)
    assert seen[0, :, 0, 0].tolist() == [0.0, 0.0, 1.0]  # the first frame fills missing ones
    assert apply_to_frames([standard], film)[0, 0, 0, 0] == 1.0
    assert (memory_of([standard, stack]), memory_of([standard])) == (2, 0)


@pytest.mark.parametrize("padding", ["same", "constant"])
@pytest.mark.parametrize("sizes", [(3,), (2, 2), (2, 3)])
def test_stacks_of_stacks_are_those_of_the_environment(sizes, padding):
    stacks = [CatFrames(N=n, dim=-3, in_keys=["pixels"], padding=padding) for n in sizes]
    env, film = with_transforms(DroneEnv(2), [GrayPixels(), *stacks]), []
    transforms, state = [*env.transform], env.reset()
    for _ in range(6):
        film.append(env.base_env.last_pixels.clone())
        seen = apply_to_frames(transforms, film[-1 - memory_of(transforms) :])
        torch.testing.assert_close(seen, state["pixels"])
        state = env.step(state.set("action", torch.zeros(2, dtype=torch.int64)))["next"]
    env.close()
