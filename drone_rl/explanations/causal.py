"""What really moves a policy within a picture, patch by patch, and how well a map tells.

All patches of a picture have one size, so that neither a cube's size nor a map's sharpness helps:
a map that says nothing scores exactly 0, whatever the policy. Pure functions of tensors and arrays.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import rankdata
from torch import Tensor

from drone_rl.explanations.hooks import actions_of, probabilities
from drone_rl.explanations.intervals import episode_means
from drone_rl.explanations.patches import Grid, replaced
from drone_rl.policies import PictureNetwork
from drone_rl.utils.intervals import mean_bounds

UNMOVED = 1e-4
"""A picture on which no patch changes the probabilities by more says nothing about maps."""
TOP = 0.1
"""Share of the patches that count as those which move the policy most."""
_EQUAL = 1e-6
"""Heat, as a share of the map's greatest, and effects that differ by less are ties."""


def patch_effects(
    network: PictureNetwork, observations: Tensor, others: Iterable[Tensor], grid: Grid
) -> NDArray:
    """How far each patch moves the policy when it alone becomes what it might have been.

    Args:
        network: The policy's.
        observations: Shape (T, C, h, w).
        others: Alternative pictures, each of shape (T, C, h, w); see `alternatives`.
        grid: The patches.

    Returns:
        Distance of the wishes before and after, its mean over the alternatives. Shape: (T, count).
    """
    base = probabilities(network, observations)
    masks, effects = grid.masks(observations.shape[-2:]), []
    distance = actions_of(network).distance
    for other in others:
        effect = base.new_zeros(len(base), grid.count)
        for frames, patches, after in replaced(network, observations, other, masks):
            effect[frames, patches] = distance(after, base[frames])
        effects.append(effect)
    return torch.stack(effects).mean(0).double().cpu().numpy()


def moving(effects: NDArray) -> NDArray:
    """Pictures in which some patch moves the policy; the others say nothing. Shape: (T,)."""
    return effects.max(1) >= UNMOVED


def scores(heat: NDArray, effects: NDArray) -> NDArray:
    """How well each map tells which patches move the policy.

    Args:
        heat: Mean heat of each patch. Shape: (T, count).
        effects: From `patch_effects`. Shape: (T, count).

    Returns:
        Spearman's rank correlation within each picture, -1 to 1; 0 where either is the same
        everywhere. Shape: (T,).
    """
    return rank_correlation(_levels(heat), np.round(effects / _EQUAL))


def pointing(heat: NDArray, effects: NDArray) -> tuple[NDArray, NDArray]:
    """Is the hottest patch one of those that move the policy most?

    Args:
        heat: Shape (T, count).
        effects: Shape (T, count).

    Returns:
        Whether it is (of several hottest ones, the share that is), and chance: the share of all
        patches that count as moving it most (a tenth; more if they move it equally, fewer if the
        others don't move it at all). Both (T,).
    """
    levels, moved = _levels(heat), np.round(effects / _EQUAL)
    number = max(1, round(TOP * effects.shape[1]))
    least = np.sort(moved, axis=1)[:, -number]
    most = (moved >= least[:, None]) & (moved > 0)
    hottest = levels == levels.max(1, keepdims=True)
    return (hottest & most).sum(1) / hottest.sum(1), most.mean(1)


def rank_correlation(first: NDArray, second: NDArray) -> NDArray:
    """Spearman's correlation of each row of two arrays; 0 where one is constant. Shape: (T,)."""
    a, b = rankdata(first, axis=1), rankdata(second, axis=1)
    a, b = a - a.mean(1, keepdims=True), b - b.mean(1, keepdims=True)
    norm = np.sqrt((a**2).sum(1) * (b**2).sum(1))
    return np.divide((a * b).sum(1), norm, out=np.zeros(len(a)), where=norm > 0)


def spread(episode: NDArray, most: int) -> NDArray:
    """Indices of at most so many frames of each episode, evenly spread. Shape: (N,)."""
    found = [np.zeros(0, np.int64)]
    for number in np.unique(episode):
        rows = np.flatnonzero(episode == number)
        found.append(rows[np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(np.int64)])
    return np.concatenate(found)


def summarise_scores(values: NDArray, episode: NDArray) -> dict[str, Any]:
    """The mean of scores over episodes with its interval; see `mean_bounds`."""
    return mean_bounds(episode_means(values, episode).clip(-1, 1), -1.0, 1.0)


def _levels(heat: NDArray) -> NDArray:
    """Heat in steps so fine that only rounding errors become ties. Shape kept."""
    peak = np.abs(heat).max(1, keepdims=True)
    return np.round(heat / np.where(peak > 0, peak, 1.0) / _EQUAL)
