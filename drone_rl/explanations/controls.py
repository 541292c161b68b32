"""Maps that know nothing of the policy: what a map must beat to have said anything about it."""

import copy
from collections.abc import Iterator, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from drone_rl.explanations.patches import rank_correlation
from drone_rl.policies import PictureNetwork


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


NO_HEAT = 1e-6
"""Share of a map's greatest heat up to which a pixel has none."""
NO_CHANGE = 1e-9
"""Deviation of a logit over pictures up to which no picture changes it."""


def shuffled_networks(
    network: PictureNetwork, observations: Tensor, count: int, seed: int = 0
) -> Iterator[PictureNetwork]:
    """Copies of a policy whose weights, and whose biases, were shuffled within each layer.

    Shuffled weights are often dead, and a map could tell them by that alone. So each copy's logits
    are given the mean and the deviation that the policy's have.

    Args:
        network: Stays as it is.
        observations: Over which mean and deviation are taken. Shape: (T, C, h, w).
        count: How many.
        seed: Of the shuffling; the first of many copies are those of few.
    """
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        logits = network(observations)
    for _ in range(count):
        other = copy.deepcopy(network)
        for parameter in other.parameters():
            _shuffle(parameter, generator)
        _enliven(other, observations, logits)
        yield other


@torch.no_grad()
def _shuffle(parameter: Tensor, generator: torch.Generator) -> None:
    order = torch.randperm(parameter.numel(), generator=generator)
    parameter.copy_(parameter.flatten()[order].view(parameter.shape))


@torch.no_grad()
def _enliven(network: PictureNetwork, observations: Tensor, wanted: Tensor) -> None:
    """Gives logits the mean and deviation of others; what is the same on all pictures stays so."""
    deviation, mean = torch.std_mean(network(observations), 0, correction=0)
    wanted_deviation, wanted_mean = torch.std_mean(wanted, 0, correction=0)
    factor = torch.where(deviation > NO_CHANGE, wanted_deviation / deviation, 1.0)
    network.rescale(factor, wanted_mean - factor * mean)


def likeness(first: Tensor, second: Tensor) -> NDArray:
    """Rank correlation of maps over the pixels on which not both are without heat.

    What both leave out (where a picture equals the baseline, say) would make any two maps alike.

    Args:
        first: Shape (T, h, w), 0 or more.
        second: Shape (T, h, w).

    Returns:
        Shape: (T,); 1 where both are the same everywhere, or one has no heat at all: that shows no
        dependence on anything.
    """
    likeness = np.ones(len(first))
    pairs = zip(first.flatten(1).double().numpy(), second.flatten(1).double().numpy(), strict=True)
    for t, (a, b) in enumerate(pairs):
        if a.max() > 0 and b.max() > 0:
            hot = (a > NO_HEAT * a.max()) | (b > NO_HEAT * b.max())
            if max(np.ptp(a[hot]) / a.max(), np.ptp(b[hot]) / b.max()) > NO_HEAT:
                likeness[t] = rank_correlation(a[None, hot], b[None, hot])[0]
    return likeness
