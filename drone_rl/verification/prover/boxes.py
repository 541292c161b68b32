"""Sets of placements as disjoint boxes: products of intervals, one for each cube.

Boxes are arrays of shape (N, n, 2): N boxes, the lower and upper end for each of n cubes, metres.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Boxes = NDArray[np.float64]
_Number = TypeVar("_Number", np.float64, np.int64)
Sides = Sequence[NDArray[np.float64]]
"""Along each axis, where the cells of a grid begin and end."""

AT_ONCE = 1_000_000
"""Cells of a grid, so that it takes little memory."""
MOST_GRIDS = 1_000
"""That are gone through, so that it takes half a minute at most."""


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


def unite(boxes: Boxes, most: int = MOST_GRIDS) -> Boxes:
    """The same set in disjoint boxes, where they overlap.

    Args:
        boxes: Any.
        most: Grids, see `_grids`; where it takes more, boxes are left as they are.
    """
    if len(boxes) < 2:
        return boxes
    boxes = np.unique(boxes, axis=0)
    hull = np.stack([boxes[..., 0].min(0), boxes[..., 1].max(0)], -1)[None]
    grids = _grids(boxes, hull, most)
    if grids is None:
        return merge(boxes)
    return merge(np.concatenate([_of_grid(_covered(*grid), grid[1]) for grid in grids]))


def beyond(boxes: Boxes, space: Boxes, most: int = MOST_GRIDS) -> Boxes | None:
    """What some boxes leave of another one, in disjoint boxes.

    Args:
        boxes: Any within the other one.
        space: That one. Shape: (1, n, 2).
        most: See `unite`.

    Returns:
        None if it would take more.
    """
    grids = _grids(boxes, space, most)
    if grids is None:
        return None
    return merge(np.concatenate([_of_grid(~_covered(*grid), grid[1]) for grid in grids]))


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


def _grids(boxes: Boxes, space: Boxes, most: int) -> list[tuple[Boxes, Sides]] | None:
    """A space in parts that are small enough: the boxes in each, and its sides and theirs.

    Args:
        boxes: Any within the space.
        space: One box.
        most: Parts, so that time is bounded.

    Returns:
        None if there would be more.
    """
    found: list[tuple[Boxes, Sides]] = []
    rest = [(boxes, space)]
    while rest:
        boxes, space = rest.pop()
        every = np.concatenate([boxes, space])
        sides = [np.unique(every[:, k]) for k in range(every.shape[1])]
        if math.prod(map(len, sides)) <= AT_ONCE:
            found.append((boxes, sides))
        else:
            longest = max(range(len(sides)), key=lambda k: len(sides[k]))
            middle = longest, sides[longest][len(sides[longest]) // 2]
            rest += zip(cut(boxes, *middle), cut(space, *middle), strict=True)
        if len(found) + len(rest) > most:
            return None
    return found


def _covered(boxes: Boxes, sides: Sides) -> NDArray[np.bool_]:
    """Which cells between the sides any box has."""
    ends = np.stack([np.searchsorted(side, boxes[:, k]) for k, side in enumerate(sides)], 1)
    count = np.zeros([len(side) for side in sides], np.int32)
    for corner in itertools.product((0, 1), repeat=len(sides)):
        at = tuple(ends[:, k, end] for k, end in enumerate(corner))
        np.add.at(count, at, (-1) ** sum(corner))
    for axis in range(len(sides)):
        count = count.cumsum(axis)
    return count[(slice(-1),) * len(sides)] > 0


def _of_grid(mask: NDArray[np.bool_], sides: Sides) -> Boxes:
    """The cells between the sides that are set."""
    ends = blocks(mask)
    return merge(np.stack([side[ends[:, k]] for k, side in enumerate(sides)], 1))


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


E = TypeVar("E")

_AT_ONCE = 10_000_000
"""Pairs of boxes that are compared at a time; bounds memory."""


def settle(
    forks: Sequence[Boxes], ways: Mapping[E, Boxes], unknown: Sequence[Boxes], num_cubes: int
) -> tuple[dict[E, Boxes], Boxes]:
    """Parts forks by how they end.

    Args:
        forks: Where there is more than one way, disjoint.
        ways: Where a way may end so; together they cover the forks.
        unknown: Where a way may end in another manner.
        num_cubes: How many intervals a box has.

    Returns:
        The forks that can only end so, disjoint; and the rest.
    """
    left = merge(np.concatenate([np.empty((0, num_cubes, 2)), *forks]))
    if not ways:
        return {}, left
    usual = max(ways, key=lambda e: volumes(ways[e]).sum())
    different = list(ways.values())
    both = [intersect(a, b) for i, a in enumerate(different) for b in different[i + 1 :]]
    holes = unite(np.concatenate([left[:0], *unknown, *both]))
    is_special = _meets(left, np.concatenate([holes, *(b for e, b in ways.items() if e != usual)]))
    settled: dict[E, list[Boxes]] = {usual: [left[~is_special]]}
    left = left[is_special]
    undecided = []
    for hole in holes:
        inside, left = carve(left, hole)
        undecided.append(inside)
    for ending, boxes in ways.items():
        for part in boxes:
            inside, left = carve(left, part)
            settled.setdefault(ending, []).append(inside)
    return (
        {ending: np.concatenate(parts) for ending, parts in settled.items()},
        np.concatenate([left, *undecided]),
    )


def _meets(boxes: Boxes, others: Boxes) -> NDArray[np.bool_]:
    """Which boxes have something in common with any of some others."""
    found = np.zeros(len(boxes), bool)
    step = max(1, _AT_ONCE // max(1, len(others)))
    for begin in range(0, len(boxes), step):
        some = boxes[begin : begin + step, None]
        is_apart = (some[..., 0] >= others[..., 1]) | (some[..., 1] <= others[..., 0])
        found[begin : begin + step] = (~is_apart.any(-1)).any(-1)
    return found
