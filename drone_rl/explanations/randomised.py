"""Policies whose weights were shuffled, and how like their maps are (Adebayo et al., 2018)."""

import copy
from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.causal import rank_correlation
from drone_rl.policies import PictureNetwork

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
