"""Parts of pictures: patches of one size, and what a policy does when some are replaced."""

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
"""About so many in a picture."""


@dataclasses.dataclass(frozen=True)
class Grid:
    """Patches of one size on a picture; rows and columns that don't fit are left out evenly."""

    height: int
    """Pixels down a patch."""
    width: int
    """Pixels across a patch."""
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
        """Rows and columns of pixels of a patch; patches are counted row by row."""
        row, column = divmod(patch, self.columns)
        top, left = self.top + row * self.height, self.left + column * self.width
        return slice(top, top + self.height), slice(left, left + self.width)

    def masks(self, size: tuple[int, ...]) -> Tensor:
        """The pixels of each patch in a picture of that size. Shape: (count, h, w), bool."""
        masks = torch.zeros(self.count, *size, dtype=torch.bool)
        for i in range(self.count):
            rows, columns = self.span(i)
            masks[i, rows, columns] = True
        return masks

    def means(self, maps: Tensor) -> NDArray:
        """Mean heat of each patch. Shape: (T, h, w) to (T, count), float64."""
        spans = [self.span(i) for i in range(self.count)]
        heat = [maps[:, rows, columns].double().mean((1, 2)) for rows, columns in spans]
        return torch.stack(heat, 1).cpu().numpy()


def make_grid(height: int, width: int, patches: int = PATCHES) -> Grid:
    """About so many patches, rather square, that leave out as little of a picture as can be.

    Args:
        height: Of the picture, pixels.
        width: Of the picture, pixels.
        patches: Wanted number.
    """
    best, cost = Grid(1, 1, height, width), np.inf
    for rows in range(1, height + 1):
        for columns in range(1, min(width, 2 * patches // rows) + 1):
            down, across = height // rows, width // columns
            lost = 1 - rows * down * columns * across / (height * width)
            crowd = abs(np.log(rows * columns / patches))
            long = abs(np.log(across / down))
            if 4 * lost + crowd + 0.5 * long < cost:
                cost = 4 * lost + crowd + 0.5 * long
                top, left = (height - rows * down) // 2, (width - columns * across) // 2
                best = Grid(down, across, rows, columns, top, left)
    return best


@torch.no_grad()
def replaced(
    network: PictureNetwork, observations: Tensor, other: Tensor, masks: Tensor
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Asks the policy about pictures of which one part was replaced, for all parts that differ.

    Args:
        network: The policy's.
        observations: Shape (T, C, h, w).
        other: What takes their place. Shape: (T, C, h, w).
        masks: The parts. Shape: (P, h, w), bool.

    Yields:
        In batches: the picture's number (n,), the part's number (n,) and the probabilities of the
        actions then (n, num_actions). Parts that look the same in both are left out.
    """
    masks = masks.to(observations.device)
    pixels = (observations != other).any(1).flatten(1).float()
    for batch in (pixels @ masks.flatten(1).float().T > 0).nonzero().split(BATCH):
        frames, parts = batch.unbind(1)
        changed = torch.where(masks[parts, None], other[frames], observations[frames])
        yield frames, parts, actions_of(network).wish(network(changed))


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


def sample_frames(episode: NDArray, most: int) -> NDArray:
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
