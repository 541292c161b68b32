"""Maps that know nothing of the policy: what a map must beat to have said anything about it."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional


def placebo_maps(
    observations: Tensor, absent: Tensor, others: Sequence[Tensor], seed: int = 0
) -> dict[str, Tensor]:
    """Maps made of pictures alone, or of nothing at all.

    Args:
        observations: Shape (T, C, h, w).
        absent: The scene without cubes. Shape: (C, h, w).
        others: What each picture might have been; see `alternatives`. Shape: (T, C, h, w) each.
        seed: Of the noise.

    Returns:
        By name, shape (T, h, w), 0 or more: ones; noise, another in each picture; a blob in the
        middle; a band along the horizon; how far the picture differs from the empty scene, the
        same smoothed, and how far it differs from what it might have been.
    """
    count, _, height, width = observations.shape
    generator = torch.Generator().manual_seed(seed)
    differs = difference(observations, absent)
    return {
        "ones": torch.ones(count, height, width),
        "noise": torch.rand(count, height, width, generator=generator),
        "blob in the middle": blob(height, width, 0.5, 0.5).expand(count, -1, -1),
        "horizon": band(height, width, horizon_row(absent)).expand(count, -1, -1),
        "picture - empty scene": differs,
        "picture - empty scene, smoothed": smoothed(differs),
        "size of the change": torch.stack([difference(observations, o) for o in others]).mean(0),
    }


def difference(observations: Tensor, absent: Tensor) -> Tensor:
    """How far each pixel is from the empty scene's. Shape: (T, h, w)."""
    return (observations - absent).abs().sum(1)


def blob(height: int, width: int, down: float, across: float, size: float = 0.2) -> Tensor:
    """A Gaussian hill.

    Args:
        height: Of the map, pixels.
        width: Of the map, pixels.
        down: Place of its top, as a share of the height.
        across: Place of its top, as a share of the width.
        size: Its deviation, as a share of height and width.
    """
    y = (torch.arange(height) + 0.5) / height
    x = (torch.arange(width) + 0.5) / width
    return torch.exp(-((y[:, None] - down) ** 2 + (x - across) ** 2) / (2 * size**2))


def band(height: int, width: int, row: float, size: float = 0.1) -> Tensor:
    """A horizontal band about a row of pixels; `size` is a share of the height."""
    away = (torch.arange(height) - row) / (size * height)
    return torch.exp(-(away[:, None] ** 2) / 2).expand(height, width)


def horizon_row(absent: Tensor) -> float:
    """The row of pixels at which the empty scene changes most from top to bottom."""
    steps = absent.diff(dim=1).abs().mean((0, 2))
    return float(steps.argmax()) + 0.5


def smoothed(maps: Tensor, passes: int = 2) -> Tensor:
    """Maps blurred by a box of a tenth of the width, some times over. Shape kept: (T, h, w)."""
    box = 2 * max(1, maps.shape[-1] // 20) + 1
    for _ in range(passes):
        padded = functional.pad(maps[:, None], [box // 2] * 4, mode="replicate")
        maps = functional.avg_pool2d(padded, box, stride=1)[:, 0]
    return maps
