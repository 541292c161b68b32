"""Sets of placements as disjoint boxes: products of intervals, one per cube.

Boxes are arrays of shape (N, n, 2): the lower and upper end of N boxes for each of n cubes, metres.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Boxes = NDArray[np.float64]
_Number = TypeVar("_Number", np.float64, np.int64)
E = TypeVar("E")
Sides = Sequence[NDArray[np.float64]]  # borders of a grid's cells along each axis

AT_ONCE = 1_000_000  # cells of a grid; bounds memory
MAX_GRIDS = 1_000  # bounds the time to about half a minute
_MAX_PAIRS = 10_000_000  # pairs of boxes compared at a time; bounds memory


def all_placements(bound: float, num_cubes: int) -> Boxes:
    """Return the box of all placements: each cube is anywhere from -bound to bound."""
    return np.broadcast_to([-bound, bound], (1, num_cubes, 2)).astype(np.float64)


def volumes(boxes: Boxes) -> NDArray[np.float64]:
    """Return the volume of each box. Shape: (N,)."""
    return np.prod(boxes[..., 1] - boxes[..., 0], axis=-1)


def cut(boxes: Boxes, cube: int, place: float) -> tuple[Boxes, Boxes]:
    """Cut boxes at one coordinate of a cube into the parts below and above it."""
    below = boxes[boxes[:, cube, 0] < place].copy()
    below[:, cube, 1] = np.minimum(below[:, cube, 1], place)
    above = boxes[boxes[:, cube, 1] > place].copy()
    above[:, cube, 0] = np.maximum(above[:, cube, 0], place)
    return below, above


def carve(boxes: Boxes, hole: Boxes) -> tuple[Boxes, Boxes]:
    """Cut boxes into the parts inside and outside another box of shape (n, 2)."""
    outside = []
    for cube, (lower, upper) in enumerate(hole):
        below, boxes = cut(boxes, cube, lower)
        boxes, above = cut(boxes, cube, upper)
        outside += [below, above]
    return boxes, np.concatenate(outside)


def intersect(boxes: Boxes, others: Boxes) -> Boxes:
    """Return the nonempty intersections of all pairs of boxes."""
    lower = np.maximum(boxes[:, None, :, 0], others[None, :, :, 0])
    upper = np.minimum(boxes[:, None, :, 1], others[None, :, :, 1])
    is_some = (lower < upper).all(-1)
    return np.stack([lower[is_some], upper[is_some]], -1)


def merge(boxes: NDArray[_Number]) -> NDArray[_Number]:
    """Return the same set in fewer boxes: join boxes that share a whole side."""
    before = -1
    while len(boxes) not in (before, 0, 1):
        before = len(boxes)
        for cube in range(boxes.shape[1]):
            boxes = _join(boxes, cube)
    return boxes


def union(boxes: Boxes, most: int = MAX_GRIDS) -> Boxes:
    """Return the union of boxes as disjoint boxes.

    If it takes more than `most` grids, the boxes are only merged and may still overlap.
    """
    if len(boxes) < 2:
        return boxes
    boxes = np.unique(boxes, axis=0)
    hull = np.stack([boxes[..., 0].min(0), boxes[..., 1].max(0)], -1)[None]
    parts = _select(boxes, hull, most, covered=True)
    return merge(boxes) if parts is None else parts


def complement(boxes: Boxes, space: Boxes, most: int = MAX_GRIDS) -> Boxes | None:
    """Return the part of a space, shape (1, n, 2), outside all boxes, as disjoint boxes.

    The boxes must lie within the space. None if it takes more than `most` grids.
    """
    return _select(boxes, space, most, covered=False)


def _select(boxes: Boxes, space: Boxes, most: int, *, covered: bool) -> Boxes | None:
    """Return the part of a space that is covered, or not; None if `most` grids do not suffice."""
    parts = []
    for some, sides in _grids(boxes, space, most) or ():
        ends = blocks(_covered(some, sides) == covered)
        parts.append(merge(np.stack([side[ends[:, k]] for k, side in enumerate(sides)], 1)))
    return merge(np.concatenate(parts)) if parts else None


def unite(intervals: NDArray[np.float64], gap: float) -> NDArray[np.float64]:
    """Merge intervals, (N, 2), that overlap or are at most `gap` apart; return them sorted."""
    starts, stops = intervals[intervals[:, 0].argsort(kind="stable")].T
    is_new = starts[1:] > np.maximum.accumulate(stops)[:-1] + gap
    first = np.flatnonzero(np.append(True, is_new)[: len(starts)])
    if not len(first):
        return intervals
    return np.stack([starts[first], np.maximum.reduceat(stops, first)], -1)


def blocks(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the true cells of a mask as blocks: first cell and end. Shape: (N, axes, 2)."""
    edges = np.diff(mask.view(np.int8), prepend=0, append=0, axis=-1)
    first, last = np.argwhere(edges > 0), np.argwhere(edges < 0)
    after = first + 1
    after[:, -1] = last[:, -1]
    return np.stack([first, after], -1)


def ragged(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return row and index in the row of each entry of rows with these lengths."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def resolve_forks(
    forks: Sequence[Boxes], endings: Mapping[E, Boxes], unknown: Sequence[Boxes], num_cubes: int
) -> tuple[dict[E, Boxes], Boxes]:
    """Assign forks, placements with several possible actions, to the ending all branches share.

    The forks are disjoint. From each box of `endings`, at least one branch has that ending; from
    each box of `unknown`, at least one has no known ending. Together these boxes cover the forks.

    Returns:
        The forks with exactly one possible ending, disjoint, by ending; and the rest.
    """
    left = merge(np.concatenate([np.empty((0, num_cubes, 2)), *forks]))
    if not endings:
        return {}, left
    usual = max(endings, key=lambda e: volumes(endings[e]).sum())
    different = list(endings.values())
    both = [intersect(a, b) for i, a in enumerate(different) for b in different[i + 1 :]]
    holes = union(np.concatenate([left[:0], *unknown, *both]))
    others = [boxes for ending, boxes in endings.items() if ending != usual]
    is_special = _meets(left, np.concatenate([holes, *others]))
    decided: dict[E, list[Boxes]] = {usual: [left[~is_special]]}
    left = left[is_special]
    undecided = []
    for hole in holes:
        inside, left = carve(left, hole)
        undecided.append(inside)
    for ending, boxes in endings.items():
        for part in boxes:
            inside, left = carve(left, part)
            decided.setdefault(ending, []).append(inside)
    return (
        {ending: np.concatenate(parts) for ending, parts in decided.items()},
        np.concatenate([left, *undecided]),
    )


def _meets(boxes: Boxes, others: Boxes) -> NDArray[np.bool_]:
    """Return which boxes intersect any of the others."""
    meets = np.zeros(len(boxes), bool)
    step = max(1, _MAX_PAIRS // max(1, len(others)))
    for begin in range(0, len(boxes), step):
        some = boxes[begin : begin + step, None]
        is_apart = (some[..., 0] >= others[..., 1]) | (some[..., 1] <= others[..., 0])
        meets[begin : begin + step] = (~is_apart.any(-1)).any(-1)
    return meets


def _grids(boxes: Boxes, space: Boxes, most: int) -> list[tuple[Boxes, Sides]] | None:
    """Cut a space into up to `most` small grids, each with its boxes and borders, if possible."""
    grids: list[tuple[Boxes, Sides]] = []
    rest = [(boxes, space)]
    while rest:
        boxes, space = rest.pop()
        every = np.concatenate([boxes, space])
        sides = [np.unique(every[:, k]) for k in range(every.shape[1])]
        if math.prod(map(len, sides)) <= AT_ONCE:
            grids.append((boxes, sides))
        else:
            longest = max(range(len(sides)), key=lambda k: len(sides[k]))
            middle = longest, sides[longest][len(sides[longest]) // 2]
            rest += zip(cut(boxes, *middle), cut(space, *middle), strict=True)
        if len(grids) + len(rest) > most:
            return None
    return grids


def _covered(boxes: Boxes, sides: Sides) -> NDArray[np.bool_]:
    """Return whether each cell of a grid is covered by a box."""
    ends = np.stack([np.searchsorted(side, boxes[:, k]) for k, side in enumerate(sides)], 1)
    count = np.zeros([len(side) for side in sides], np.int32)
    for corner in itertools.product((0, 1), repeat=len(sides)):
        at = tuple(ends[:, k, end] for k, end in enumerate(corner))
        np.add.at(count, at, (-1) ** sum(corner))
    for axis in range(len(sides)):
        count = count.cumsum(axis)
    return count[(slice(-1),) * len(sides)] > 0


def _join(boxes: NDArray[_Number], cube: int) -> NDArray[_Number]:
    """Join boxes that differ only in one cube's interval and meet there."""
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
