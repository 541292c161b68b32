"""What forks come to: placements at which more than one action is possible, as far as is known.

Each of them was followed along all its ways. It counts as decided if all of them end alike.
"""

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drone_rl.verification.prover.boxes import Boxes, carve, intersect, merge, unite, volumes

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
