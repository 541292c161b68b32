"""Parts of pictures: patches of one size, and what a policy does when some are replaced."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.hooks import BATCH, actions_of
from drone_rl.policies import PictureNetwork

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
