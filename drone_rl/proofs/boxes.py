"""Sets of placements as disjoint boxes: products of intervals, one for each cube.

Boxes are arrays of shape (N, n, 2): N boxes, the lower and upper end for each of n cubes, metres.
"""

import itertools
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Boxes = NDArray[np.float64]
_Number = TypeVar("_Number", np.float64, np.int64)


def whole(bound: float, num_cubes: int) -> Boxes:
    """All placements: every cube anywhere from -bound to bound."""
    return np.broadcast_to([-bound, bound], (1, num_cubes, 2)).astype(np.float64)


def volumes(boxes: Boxes) -> NDArray[np.float64]:
    """Of each box. Shape: (N,)."""
    return np.prod(boxes[..., 1] - boxes[..., 0], axis=-1)


def cut(boxes: Boxes, cube: int, place: float) -> tuple[Boxes, Boxes]:
    """Boxes in two: where a cube stands to the right of a place, and where to the left."""
    below = boxes[boxes[:, cube, 0] < place].copy()
    below[:, cube, 1] = np.minimum(below[:, cube, 1], place)
    above = boxes[boxes[:, cube, 1] > place].copy()
    above[:, cube, 0] = np.maximum(above[:, cube, 0], place)
    return below, above


def merge(boxes: NDArray[_Number]) -> NDArray[_Number]:
    """The same set in fewer boxes: neighbours with a whole side in common become one."""
    before = -1
    while len(boxes) not in (before, 0, 1):
        before = len(boxes)
        for cube in range(boxes.shape[1]):
            boxes = _join(boxes, cube)
    return boxes


def unite(boxes: Boxes, most: int = 10_000_000) -> Boxes:
    """The same set in disjoint boxes, where they overlap.

    Args:
        boxes: Any.
        most: Cells of the grid that all their sides make, above which they are left as they are.
    """
    boxes = np.unique(boxes, axis=0)
    n = boxes.shape[1]
    sides = [np.unique(boxes[:, k]) for k in range(n)]
    shape = [len(side) for side in sides]
    if len(boxes) < 2 or np.prod(shape, dtype=float) > most:
        return merge(boxes)
    ends = np.stack([np.searchsorted(side, boxes[:, k]) for k, side in enumerate(sides)], 1)
    count = np.zeros(shape, np.int32)
    for corner in itertools.product((0, 1), repeat=n):
        at = tuple(ends[:, k, end] for k, end in enumerate(corner))
        np.add.at(count, at, (-1) ** sum(corner))
    for axis in range(n):
        count = count.cumsum(axis)
    lower, upper = np.moveaxis(blocks(count > 0), -1, 0)
    ends = [np.stack([side[lower[:, k]], side[upper[:, k]]], -1) for k, side in enumerate(sides)]
    return merge(np.stack(ends, 1))


def blocks(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Where a grid's cells are set, as disjoint boxes of whole cells; not the fewest.

    Returns:
        First cell along each axis, and the one after the last. Shape: (N, axes, 2).
    """
    edges = np.diff(mask.view(np.int8), prepend=0, append=0, axis=-1)
    first, last = np.argwhere(edges > 0), np.argwhere(edges < 0)
    beyond = first + 1
    beyond[:, -1] = last[:, -1]
    return np.stack([first, beyond], -1)


def intersect(boxes: Boxes, others: Boxes) -> Boxes:
    """What any of some boxes have in common with any of some others; empty pieces left out."""
    lower = np.maximum(boxes[:, None, :, 0], others[None, :, :, 0])
    upper = np.minimum(boxes[:, None, :, 1], others[None, :, :, 1])
    is_some = (lower < upper).all(-1)
    return np.stack([lower[is_some], upper[is_some]], -1)


def ragged(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers rows of different lengths: which row each entry belongs to, and its place there."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def _join(boxes: NDArray[_Number], cube: int) -> NDArray[_Number]:
    """Joins boxes that differ in one cube's interval alone and meet there."""
    if len(boxes) < 2:
        return boxes
    others = [k for k in range(boxes.shape[1]) if k != cube]
    rest = boxes[:, others].reshape(len(boxes), -1)
    order = np.lexsort((boxes[:, cube, 0], *rest.T))
    boxes, rest = boxes[order], rest[order]
    meets = boxes[1:, cube, 0] == boxes[:-1, cube, 1]
    meets &= (rest[1:] == rest[:-1]).all(-1)
    if not meets.any():
        return boxes
    first = np.flatnonzero(np.concatenate([[True], ~meets]))
    last = np.concatenate([first[1:], [len(boxes)]]) - 1
    joined = boxes[first]
    joined[:, cube, 1] = boxes[last, cube, 1]
    return joined


def carve(boxes: Boxes, hole: Boxes) -> tuple[Boxes, Boxes]:
    """Boxes in two: what lies in another box, and what does not.

    Args:
        boxes: Any.
        hole: The other one. Shape: (n, 2).
    """
    outside = []
    for cube, (lower, upper) in enumerate(hole):
        below, boxes = cut(boxes, cube, lower)
        boxes, above = cut(boxes, cube, upper)
        outside += [below, above]
    return boxes, np.concatenate(outside)
