"""Image transforms, by hand-computed values and in pipelines."""

import pytest
import torch
from torchrl.envs import CatFrames, Compose, RewardSum, StepCounter, TransformedEnv
from torchrl.envs.utils import check_env_specs

from drone_rl.envs import (
    ChromaticityPixels,
    CropRows,
    DroneEnv,
    GrayPixels,
    Pipeline,
    Resize,
    RgbPixels,
    StandardizePixels,
)
from drone_rl.utils.errors import InputError


@pytest.fixture(scope="module")
def base():
    env = DroneEnv(2)
    yield env
    env.close()


PIPELINES = {
    "gray": lambda: [GrayPixels()],
    "rgb": lambda: [RgbPixels()],
    "chromaticity": lambda: [RgbPixels(), ChromaticityPixels()],
    "standardize": lambda: [GrayPixels(), StandardizePixels()],
    "crop": lambda: [GrayPixels(), CropRows(5, 20)],
    "resize": lambda: [GrayPixels(), Resize(height=10, width=32)],
    "everything": lambda: [
        GrayPixels(),
        CropRows(1, 25),
        Resize(height=12, width=32),
        StandardizePixels(),
        CatFrames(2, dim=-3, in_keys=["pixels"]),
        RewardSum(),
        StepCounter(),
    ],
}


@pytest.mark.parametrize("name", PIPELINES)
def test_specs_agree_with_data(base, name):
    env = TransformedEnv(base, Compose(*PIPELINES[name]()))
    check_env_specs(env, break_when_any_done="both")


def test_gray_matches_hand_computed_values():
    pixels = torch.tensor([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [100, 100, 100]]])
    gray = GrayPixels()._apply_transform(pixels.to(torch.uint8))
    assert gray.shape == (1, 2, 2)
    expected = torch.tensor([[[0.299, 0.587], [0.114, 100 / 255]]])
    torch.testing.assert_close(gray, expected)


def test_rgb_matches_hand_computed_values():
    pixels = torch.tensor([[[255, 0, 51], [0, 102, 0]]], dtype=torch.uint8)
    rgb = RgbPixels()._apply_transform(pixels)
    torch.testing.assert_close(rgb, torch.tensor([[[1.0, 0]], [[0, 0.4]], [[0.2, 0]]]))


def test_resize_averages_areas_with_separate_height_and_width():
    pixels = torch.arange(8.0).reshape(1, 2, 4)
    resized = Resize(height=1, width=2)._apply_transform(pixels)
    assert resized.tolist() == [[[2.5, 4.5]]]


def test_crop_uses_top_inclusive_and_bottom_exclusive():
    pixels = torch.arange(5.0).reshape(1, 5, 1)
    assert CropRows(1, 4)._apply_transform(pixels).flatten().tolist() == [1.0, 2.0, 3.0]


def test_invalid_arguments_raise():
    with pytest.raises(InputError, match="give top < bottom"):
        CropRows(5, 5)._apply_transform(torch.zeros(1, 9, 4))
    with pytest.raises(InputError, match="at most 4"):
        CropRows(0, 5)._apply_transform(torch.zeros(1, 4, 4))
    with pytest.raises(InputError, match="height=0"):
        Resize(height=0, width=4)
    with pytest.raises(InputError, match=r"std=0\.0"):
        StandardizePixels(std=0.0)
    for transform in (GrayPixels(), RgbPixels()):
        with pytest.raises(InputError, match=r"Pixels got torch.float32 frames of .*; give uint8"):
            transform._apply_transform(torch.zeros(2, 2, 3))


def as_image(*colors):
    return torch.tensor(colors).T[:, None]


def test_chromaticity_is_the_fraction_of_each_color_minus_a_third():
    seen = ChromaticityPixels(floor=0.5)._apply_transform(
        as_image((1.0, 0.0, 0.0), (0.2, 0.2, 0.2), (0.0, 0.5, 1.0))
    )
    thirds = [[2 / 3 / 1.5, 0.0, -0.5 / 2.0], [-1 / 3 / 1.5, 0.0, 0.5 / 2.0]]
    torch.testing.assert_close(seen, torch.tensor(thirds)[:, None])


def test_a_pipeline_applies_only_pixel_transforms_in_order():
    white = torch.full((3, 4, 2, 3), 255, dtype=torch.uint8)
    standard = StandardizePixels(mean=0.5, std=0.25)
    made = Pipeline([RewardSum(), GrayPixels(), standard, CropRows(1, 4)])(white)
    torch.testing.assert_close(made, torch.full((3, 1, 3, 2), 2.0))
    assert Pipeline([])(white) is white


@pytest.mark.parametrize("padding", ["same", "constant"])
@pytest.mark.parametrize("sizes", [(3,), (2, 2), (2, 3)])
def test_stacks_equal_those_of_torchrl(sizes, padding):
    stacks = [CatFrames(N=n, dim=-3, in_keys=["pixels"], padding=padding) for n in sizes]
    env = DroneEnv(2, transforms=[GrayPixels(), *stacks])
    other = TransformedEnv(DroneEnv(2), Compose(GrayPixels(), *stacks))
    state, expected = env.reset(), other.reset()
    for _ in range(6):
        assert torch.equal(state["pixels"], expected["pixels"])
        action = torch.zeros(2, dtype=torch.int64)
        state, expected = (
            e.step(s.set("action", action))["next"] for e, s in ((env, state), (other, expected))
        )
    env.close()
