"""Gray out of red, green and blue."""

import torch
from torch import Tensor

LUMA = (0.299, 0.587, 0.114)
"""Weights of red, green and blue in a gray pixel (ITU-R BT.601), as in the original study."""
WEIGHTS = tuple((torch.tensor(LUMA) / 255.0).tolist())
"""The same for bytes, rounded to float32, so that gray is from 0 to 1."""


def to_gray(rgb: Tensor) -> Tensor:
    """RGB bytes to gray from 0 to 1. Shapes: (*, 3), uint8, to (*), float32.

    Each sum is rounded as kernels round it, so that gray is the same on every machine: a product of
    matrices would be rounded as its library likes.
    """
    red, green, blue = rgb.unbind(-1)
    two = (red * WEIGHTS[0]).double() + green.double() * WEIGHTS[1]
    return (two.float().double() + (blue * WEIGHTS[2]).double()).float()
