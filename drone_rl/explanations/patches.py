"""Patches of frames: their effect on the policy, and how well a heat map agrees with it.

All patches of a frame have one size, so neither the size of a target nor the sharpness of a map
matters: an uninformative map has a mean score of 0 with any policy.
"""

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import rankdata
from torch import Tensor

from drone_rl.explanations.hooks import BATCH, actions_of, probabilities
from drone_rl.policies import PictureNetwork
from drone_rl.utils.intervals import episode_means, mean_bounds

PATCHES = 40
"""Approximate number of patches of a frame."""
UNMOVED = 1e-4
"""Frames on which every patch has a smaller effect are left out of tests of maps."""
TOP = 0.1
"""Fraction of the patches that count as those with the largest effect."""
_EQUAL = 1e-6
"""Differences below this are ties: of effects, and of heat relative to the map's maximum."""


@dataclasses.dataclass(frozen=True)
class Grid:
    """Patches of one size; remaining rows and columns of pixels are left out on both sides."""

    height: int
    """Height of a patch, pixels."""
    width: int
    rows: int
    columns: int
    top: int = 0
    """Rows of pixels above the first patch."""
    left: int = 0

    @property
    def count(self) -> int:
        """Number of patches."""
        return self.rows * self.columns

    def span(self, patch: int) -> tuple[slice, slice]:
        """Return rows and columns of pixels of a patch; patches are numbered row by row."""
        row, column = divmod(patch, self.columns)
        top, left = self.top + row * self.height, self.left + column * self.width
        return slice(top, top + self.height), slice(left, left + self.width)

    def masks(self, size: tuple[int, ...]) -> Tensor:
        """Return the pixels of each patch in a frame of that size. Shape: (count, h, w), bool."""
        masks = torch.zeros(self.count, *size, dtype=torch.bool)
        for i in range(self.count):
            masks[i][self.span(i)] = True
        return masks

    def means(self, maps: Tensor) -> NDArray:
        """Return the mean heat of each patch. Shape: (T, h, w) to (T, count), float64."""
        heat = [maps[:, *self.span(i)].double().mean((1, 2)) for i in range(self.count)]
        return torch.stack(heat, 1).cpu().numpy()


def make_grid(height: int, width: int, patches: int = PATCHES) -> Grid:
    """Return about so many patches, nearly square, that leave out few pixels of a frame."""
    best, cost = Grid(1, 1, height, width), np.inf
    for rows in range(1, height + 1):
        for columns in range(1, min(width, 2 * patches // rows) + 1):
            down, across = height // rows, width // columns
            lost = 1 - rows * down * columns * across / (height * width)
            number = abs(np.log(rows * columns / patches))
            shape = abs(np.log(across / down))
            if 4 * lost + number + 0.5 * shape < cost:
                cost = 4 * lost + number + 0.5 * shape
                top, left = (height - rows * down) // 2, (width - columns * across) // 2
                best = Grid(down, across, rows, columns, top, left)
    return best


@torch.no_grad()
def replaced(
    network: PictureNetwork, observations: Tensor, other: Tensor, masks: Tensor
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Evaluate the policy with one part of an observation replaced, for all parts that differ.

    Observations and replacements are (T, C, h, w), the masks of the parts (P, h, w).

    Yields:
        In batches: indices of observations (n,) and of parts (n,), and the action probabilities
        (n, num_actions). Parts that are equal in both are left out.
    """
    masks = masks.to(observations.device)
    pixels = (observations != other).any(1).flatten(1).float()
    for batch in (pixels @ masks.flatten(1).float().T > 0).nonzero().split(BATCH):
        frames, parts = batch.unbind(1)
        changed = torch.where(masks[parts, None], other[frames], observations[frames])
        yield frames, parts, actions_of(network).wish(network(changed))


def patch_effects(
    network: PictureNetwork, observations: Tensor, others: Iterable[Tensor], grid: Grid
) -> NDArray:
    """Return the effect on the policy of replacing each patch by alternatives (T, C, h, w).

    Returns:
        Distance of the action probabilities, averaged over the alternatives. Shape: (T, count).
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
    """Return whether some patch of a frame affects the policy. Shape: (T,)."""
    return effects.max(1) >= UNMOVED


def scores(heat: NDArray, effects: NDArray) -> NDArray:
    """Return how well each map agrees with the effects of the patches, both (T, count).

    Returns:
        Spearman's rank correlation within each frame; 0 where either is constant. Shape: (T,).
    """
    return rank_correlation(_levels(heat), np.round(effects / _EQUAL))


def pointing(heat: NDArray, effects: NDArray) -> tuple[NDArray, NDArray]:
    """Return whether the hottest patch is one of those with the largest effect; both (T, count).

    Returns:
        The fraction of the hottest patches that are, and the fraction of all patches that are
        (chance): a tenth, more if effects tie, fewer if other patches have none. Both (T,).
    """
    levels, moved = _levels(heat), np.round(effects / _EQUAL)
    number = max(1, round(TOP * effects.shape[1]))
    least = np.sort(moved, axis=1)[:, -number]
    most = (moved >= least[:, None]) & (moved > 0)
    hottest = levels == levels.max(1, keepdims=True)
    return (hottest & most).sum(1) / hottest.sum(1), most.mean(1)


def rank_correlation(first: NDArray, second: NDArray) -> NDArray:
    """Return Spearman's correlation of corresponding rows; 0 where one is constant. Shape: (T,)."""
    a, b = rankdata(first, axis=1), rankdata(second, axis=1)
    a, b = a - a.mean(1, keepdims=True), b - b.mean(1, keepdims=True)
    norm = np.sqrt((a**2).sum(1) * (b**2).sum(1))
    return np.divide((a * b).sum(1), norm, out=np.zeros(len(a)), where=norm > 0)


def sample_frames(episode: NDArray, most: int) -> NDArray:
    """Return indices of at most `most` frames of each episode, evenly spaced. Shape: (N,)."""
    found = [np.zeros(0, np.int64)]
    for number in np.unique(episode):
        rows = np.flatnonzero(episode == number)
        found.append(rows[np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(np.int64)])
    return np.concatenate(found)


def summarise_scores(values: NDArray, episode: NDArray) -> dict[str, Any]:
    """Return the mean of scores over episodes with its interval; see `mean_bounds`."""
    return mean_bounds(episode_means(values, episode).clip(-1, 1), -1.0, 1.0)


def _levels(heat: NDArray) -> NDArray:
    """Round heat so that differences from floating-point errors become ties. Shape kept."""
    peak = np.abs(heat).max(1, keepdims=True)
    return np.round(heat / np.where(peak > 0, peak, 1.0) / _EQUAL)
