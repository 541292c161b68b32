import pytest
import torch

from drone_rl.sim.rendering.view import LUMA, WEIGHTS, to_gray


def test_gray_is_the_luma_with_white_one():
    colors = torch.tensor([[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 255, 0], [0, 0, 255]])
    gray = to_gray(colors.to(torch.uint8))
    assert gray.dtype == torch.float32
    assert gray.tolist() == pytest.approx([1.0, 0.0, *LUMA])


def test_weights_are_rounded_to_float32():
    assert torch.tensor(WEIGHTS).tolist() == (torch.tensor(LUMA) / 255.0).tolist() == list(WEIGHTS)
