"""Deletion and insertion: the hottest pixels are taken away first, or put back first.

A taken pixel is replaced by the scene without cubes (Petsiuk et al., 2018). Actions are told apart:
the empty scene has an action of its own, so that a mean over all of them shows the mix of actions.
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.hooks import actions_of, probabilities
from drone_rl.explanations.intervals import episode_means
from drone_rl.policies import PictureNetwork
from drone_rl.utils.intervals import mean_bounds

SHARES = (0.0, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
"""Of the pixels that are replaced. A far cube covers a hundredth of the picture."""


def deletion_insertion(
    network: PictureNetwork,
    observations: Tensor,
    actions: Tensor,
    maps: Tensor,
    absent: Tensor,
    episode: NDArray,
) -> dict[str, Any]:
    """The probability of the chosen action while pixels are taken away, or put back.

    Args:
        network: The policy's.
        observations: Shape (T, C, h, w).
        actions: Shape (T,).
        maps: Shape (T, h, w).
        absent: The scene without cubes. Shape: (C, h, w).
        episode: Shape (T,).

    Returns:
        By the name of the action that was taken, in small letters: "frames"; for "deletion" (lower
        is better) and "insertion" (higher is better) the "curve" at `SHARES`, the mean over
        episodes (None without frames), and the "area" under it with its interval.
    """
    rank = _ranks(maps)
    curves = {"deletion": [], "insertion": []}
    for share in SHARES:
        hottest = (rank < round(rank.shape[1] * rank.shape[2] * share))[:, None]
        for name, taken in (("deletion", hottest), ("insertion", ~hottest)):
            changed = torch.where(taken, absent, observations)
            curves[name].append(probabilities(network, changed).gather(1, actions[:, None])[:, 0])
    found = {}
    for number, name in enumerate(actions_of(network).names):
        rows = (actions == number).numpy()
        found[name] = {
            "frames": int(rows.sum()),
            **{
                name: _summary(torch.stack(points, 1).double().numpy()[rows], episode[rows])
                for name, points in curves.items()
            },
        }
    return found


def _ranks(maps: Tensor) -> Tensor:
    """The place of each pixel, the hottest first, ties from top to bottom. Shape: (T, h, w)."""
    order = maps.flatten(1).argsort(dim=1, descending=True, stable=True)
    places = torch.arange(order.shape[1]).expand_as(order)
    return torch.empty_like(order).scatter_(1, order, places).view(maps.shape)


def _summary(curve: NDArray, episode: NDArray) -> dict[str, Any]:
    area = np.trapezoid(curve, SHARES, axis=1).clip(0.0, 1.0)
    means = [episode_means(point, episode) for point in curve.T]
    return {
        "curve": [float(m.mean()) for m in means] if len(curve) else None,
        "area": mean_bounds(episode_means(area, episode)),
    }
