"""Requests to a renderer, and gray."""

import dataclasses

import pytest
import torch

from drone_rl.sim.rendering import View
from drone_rl.sim.rendering.view import LUMA, to_gray
from drone_rl.utils.errors import InputError

VIEW = View(cameras=("drone/front_center",), height=25, width=64)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"modalities": ("rgb", "heat")},
            "modality='heat' is unknown; give rgb, gray, depth, distance, segmentation or normals",
        ),
        ({"modalities": ()}, "shows nothing; give rgb, gray"),
        ({"height": 0}, "view of 0x64 pixels; give 1 to 4096"),
    ],
)
def test_invalid_views_raise(change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(VIEW, **change)


def test_gray_is_the_luma_with_white_one():
    colors = torch.tensor([[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 255, 0], [0, 0, 255]])
    gray = to_gray(colors.to(torch.uint8))
    assert gray.dtype == torch.float32
    assert gray.tolist() == pytest.approx([1.0, 0.0, *LUMA])
