import pytest
import torch

from drone_rl.sim.rendering.view import LUMA, WEIGHTS, to_gray


def test_white_is_one_and_colours_weigh_as_they_look():
    colors = torch.tensor([[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 255, 0], [0, 0, 255]])
    gray = to_gray(colors.to(torch.uint8))
    assert gray.dtype == torch.float32
    assert gray.tolist() == pytest.approx([1.0, 0.0, *LUMA])


def test_weights_are_what_float32_makes_of_them():
    assert torch.tensor(WEIGHTS).tolist() == (torch.tensor(LUMA) / 255.0).tolist() == list(WEIGHTS)
