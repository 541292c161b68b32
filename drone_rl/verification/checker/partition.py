"""Whether boxes are a partition of a cube, exactly: no tolerance, no rounding.

A box is known by its corners: the mixed derivative of its indicator function is a sum of deltas at
them, plus where an even number of edges are low ones, minus elsewhere. Functions that vanish far
away are equal if and only if their derivatives are; so boxes tell of every place of the cube once,
and of no place outside, if and only if their signed corners cancel but for those of the cube.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product

import numpy as np
from numpy.typing import NDArray


def volume(boxes: NDArray[np.float64]) -> Fraction:
    """The exact sum of the boxes' volumes, metres to the power of n. Boxes: (boxes, n, 2)."""
    if not len(boxes):
        return Fraction(0)
    borders, rank = np.unique(boxes, return_inverse=True)
    ratios = [border.as_integer_ratio() for border in borders.tolist()]
    unit = max(denominator for _, denominator in ratios)  # all are powers of two
    whole = np.array([n * (unit // d) for n, d in ratios], object)[rank.reshape(boxes.shape)]
    sizes = whole[..., 1] - whole[..., 0]
    return Fraction(int(sizes.prod(1).sum()), unit ** boxes.shape[1])


def find_misfit(boxes: NDArray[np.float64], bound: float) -> tuple[list[float], int] | None:
    """A place at which boxes are no partition of the cube [-bound, bound]^n.

    Args:
        boxes: None of them empty. Shape: (boxes, n, 2).
        bound: Half the edge of the cube, metres.

    Returns:
        The place, and how many boxes hold it: once is right in the cube, never outside; None if
        the boxes are a partition.
    """
    n = boxes.shape[1]
    cube = np.full((1, n, 2), (-bound, bound))
    every = np.concatenate([cube, boxes])
    axes = [np.unique(every[:, i]) for i in range(n)]
    ranks = np.stack([np.searchsorted(axis, every[:, i]) for i, axis in enumerate(axes)], 1)
    corner = _uncancelled(ranks)
    if corner is None:
        return None
    return next(_around(corner, ranks, axes))


def _uncancelled(ranks: NDArray[np.intp]) -> NDArray[np.intp] | None:
    """A corner that is left over; the first box counts as taken away. Ranks: (boxes, n, 2)."""
    n = ranks.shape[1]
    ends = np.array(list(product((0, 1), repeat=n)))  # (2^n, n)
    sign = 1 - 2 * (ends.sum(1) % 2)
    key = np.zeros((len(ranks), len(ends)), np.int64)
    for i in range(n):  # corners by number; numbered anew at each axis, so that none overflows
        key = key * (int(ranks[:, i].max()) + 1) + ranks[:, i][:, ends[:, i]]
        key = np.unique(key, return_inverse=True)[1].reshape(key.shape)
    weight = np.repeat(sign[None], len(ranks), 0)
    weight[0] *= -1
    left = np.bincount(key.ravel(), weight.ravel())  # exact: sums of at most 2^25 ones
    if not left.any():
        return None
    box, end = np.argwhere(key == np.flatnonzero(left)[0])[0]
    return ranks[box, np.arange(n), ends[end]]


def _around(
    corner: NDArray[np.intp], ranks: NDArray[np.intp], axes: Sequence[NDArray[np.float64]]
) -> Iterator[tuple[list[float], int]]:
    """The places around a corner of which boxes tell wrongly; there is one at least."""
    sides = [
        [c for c in (r - 1, r) if 0 <= c < len(axis) - 1]
        for r, axis in zip(corner, axes, strict=True)
    ]
    for cell in product(*sides):
        at = np.array(cell)
        holding = np.flatnonzero(((ranks[..., 0] <= at) & (at < ranks[..., 1])).all(1)).tolist()
        count = len(holding) - (0 in holding)
        if count != (0 in holding):
            place = [float((a[c] + a[c + 1]) / 2) for a, c in zip(axes, cell, strict=True)]
            yield place, count
