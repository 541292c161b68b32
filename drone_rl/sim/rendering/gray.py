"""Gray out of red, green and blue."""

import torch
from torch import Tensor

LUMA = (0.299, 0.587, 0.114)
"""Weights of red, green and blue in a gray pixel (ITU-R BT.601), as in the original study."""
WEIGHTS = tuple((torch.tensor(LUMA) / 255.0).tolist())
"""The same for bytes, rounded to float32, so that gray is from 0 to 1."""


def to_gray(rgb: Tensor) -> Tensor:
    """RGB bytes to gray from 0 to 1. Shapes: (*, 3), uint8, to (*), float32."""
    return rgb.float() @ torch.tensor(WEIGHTS, device=rgb.device)
