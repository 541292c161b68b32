"""Controls for heat maps: placebo maps, and maps of policies with shuffled weights."""

import copy
from collections.abc import Iterator, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from drone_rl.explanations.patches import rank_correlation
from drone_rl.policies import PictureNetwork

NO_HEAT = 1e-6
"""Heat up to this fraction of the map's maximum counts as none."""
NO_CHANGE = 1e-9
"""A logit with a smaller standard deviation over observations is constant."""


def placebo_maps(
    observations: Tensor, absent: Tensor, others: Sequence[Tensor], seed: int = 0
) -> dict[str, Tensor]:
    """Return maps (T, h, w) that do not use the policy, by name; a method must beat all of them.

    Args:
        observations: Shape (T, C, h, w).
        absent: Observation of the scene without targets. Shape: (C, h, w).
        others: Alternatives of shape (T, C, h, w) each; see `scenes.alternatives`.
        seed: Seed of the noise.
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
    """Return each pixel's difference from the empty scene. Shape: (T, h, w)."""
    return (observations - absent).abs().sum(1)


def blob(height: int, width: int, down: float, across: float, size: float = 0.2) -> Tensor:
    """Return a Gaussian. Shape: (height, width).

    Its centre and its standard deviation `size` are fractions of height and width.
    """
    y = (torch.arange(height) + 0.5) / height
    x = (torch.arange(width) + 0.5) / width
    return torch.exp(-((y[:, None] - down) ** 2 + (x - across) ** 2) / (2 * size**2))


def band(height: int, width: int, row: float, size: float = 0.1) -> Tensor:
    """Return a horizontal band around a row of pixels; `size` is a fraction of the height."""
    away = (torch.arange(height) - row) / (size * height)
    return torch.exp(-(away[:, None] ** 2) / 2).expand(height, width)


def horizon_row(absent: Tensor) -> float:
    """Return the row of pixels with the largest vertical change of the empty scene."""
    return float(absent.diff(dim=1).abs().mean((0, 2)).argmax()) + 0.5


def smoothed(maps: Tensor, passes: int = 2) -> Tensor:
    """Blur maps by a box of a tenth of the width, repeatedly. Shape kept: (T, h, w)."""
    box = 2 * max(1, maps.shape[-1] // 20) + 1
    for _ in range(passes):
        padded = functional.pad(maps[:, None], [box // 2] * 4, mode="replicate")
        maps = functional.avg_pool2d(padded, box, stride=1)[:, 0]
    return maps


@torch.no_grad()
def _shuffled(
    network: PictureNetwork, observations: Tensor, wanted: Tensor, generator: torch.Generator
) -> PictureNetwork:
    """Return a copy whose logits have the deviation, if they are not constant, and mean wanted."""
    other = copy.deepcopy(network)
    for parameter in other.parameters():
        order = torch.randperm(parameter.numel(), generator=generator)
        parameter.copy_(parameter.flatten()[order].view(parameter.shape))
    deviation, mean = torch.std_mean(other(observations), 0, correction=0)
    wanted_deviation, wanted_mean = torch.std_mean(wanted, 0, correction=0)
    factor = torch.where(deviation > NO_CHANGE, wanted_deviation / deviation, 1.0)
    other.rescale(factor, wanted_mean - factor * mean)
    return other


def shuffled_networks(
    network: PictureNetwork, observations: Tensor, count: int, seed: int = 0
) -> Iterator[PictureNetwork]:
    """Yield copies of a policy with weights and biases shuffled within each layer.

    Networks with shuffled weights are often nearly constant, which alone would distinguish their
    maps. Therefore each copy's logits are rescaled to the policy's mean and standard deviation on
    observations (T, C, h, w). The first copies do not depend on `count`.
    """
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        logits = network(observations)
    for _ in range(count):
        yield _shuffled(network, observations, logits, generator)


def likeness(first: Tensor, second: Tensor) -> NDArray:
    """Return the rank correlation of maps (T, h, w) over the pixels on which one of them has heat.

    Pixels without heat in both (such as those equal to the baseline) would make any maps similar.

    Returns:
        Shape: (T,); 1 where both are constant or one has no heat, which shows no dependence.
    """
    likeness = np.ones(len(first))
    pairs = zip(first.flatten(1).double().numpy(), second.flatten(1).double().numpy(), strict=True)
    for t, (a, b) in enumerate(pairs):
        if a.max() > 0 and b.max() > 0:
            hot = (a > NO_HEAT * a.max()) | (b > NO_HEAT * b.max())
            if max(np.ptp(a[hot]) / a.max(), np.ptp(b[hot]) / b.max()) > NO_HEAT:
                likeness[t] = rank_correlation(a[None, hot], b[None, hot])[0]
    return likeness
