"""Where to fly: corners, centres and random points of boxes, both sides of borders, anywhere."""

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from drone_rl.verification.checker.certificate import Certificate

Boxes = NDArray[np.float64]
"""Metres to the left of each cube, lowest and highest. Shape: (boxes, cubes, 2)."""
Points = NDArray[np.float64]
"""Metres to the left of each cube. Shape: (points, cubes)."""
Indices = NDArray[np.intp]
"""Shape: (points,) or (boxes,)."""

HAIR = 1e-9
"""Metres by which corners are moved inwards."""
ASIDE = 1e-4
"""Metres from a border to the places on both its sides."""
_MOST_WORK = 2**31
"""Numbers that are compared, at most, to look for borders."""


def draw_inside(boxes: Boxes, count: int, rng: np.random.Generator) -> Points:
    """Centres, corners and random points of boxes, so many in all.

    As many centres as there are boxes, but at most half; where there are more, of large boxes, of
    thin ones and of any in turn. Then all corners of as many boxes as a half of the rest allows.
    """
    chosen = boxes[_mixed(boxes, rng)]
    centres = chosen[: -(-count // 2)].mean(-1)
    left = count - len(centres)
    num_corners = 2 ** boxes.shape[1]
    corners = _corners(chosen[: -(-left // (2 * num_corners))])[:left]
    rest = rng.integers(len(chosen), size=left - len(corners))
    return np.concatenate([centres, corners, _random(chosen[rest], rng)])


def draw_anywhere(boxes: Boxes, count: int, rng: np.random.Generator) -> tuple[Points, Indices]:
    """Points that are uniform in the volume of all boxes together, and the box of each."""
    sizes = np.diff(boxes)[..., 0].prod(1)
    chosen = rng.choice(len(boxes), count, p=sizes / sizes.sum())
    return _random(boxes[chosen], rng), chosen


def draw_borders(
    groups: Sequence[Boxes], bound: float, count: int, rng: np.random.Generator
) -> Points:
    """Points on both sides of faces where boxes of different groups meet, or nearly so.

    Args:
        groups: Boxes, a partition all together.
        bound: Metres to either side at which cubes are placed at most.
        count: Points, at most; fewer where few borders are found.
        rng: Draws them.
    """
    boxes, sizes = np.concatenate(groups), np.array([len(group) for group in groups])
    tries = max(1, min(4 * count, _MOST_WORK // (4 * boxes.size)))
    some = rng.choice(np.flatnonzero(sizes), tries)
    chosen = boxes[(sizes.cumsum() - sizes)[some] + rng.integers(sizes[some])]
    row, axis = np.arange(tries), rng.integers(boxes.shape[1], size=tries)
    side = rng.integers(2, size=tries)
    on = _random(chosen, rng)
    on[row, axis] = chosen[row, axis, side]
    off = np.zeros_like(on)
    off[row, axis] = ASIDE
    pairs = np.stack([on - off, on + off], 1)  # (tries, 2, cubes)
    pairs = pairs[(abs(pairs) < bound).all((1, 2))]
    owner = np.repeat(np.arange(len(groups)), sizes)[find(boxes, pairs.reshape(-1, boxes.shape[1]))]
    pairs = pairs[owner[::2] != owner[1::2]]
    new = np.sort(np.unique(pairs, axis=0, return_index=True)[1])  # of one cube there are few
    return pairs[new].reshape(-1, boxes.shape[1])[:count]


def find(boxes: Boxes, points: Points) -> Indices:
    """A box for each point that holds it, inside or on its border. Shape: (points,).

    Raises:
        ValueError: There is none.
    """
    low, high = (np.ascontiguousarray(boxes[..., end].T) for end in (0, 1))  # (cubes, boxes)
    found = np.zeros(len(points), np.intp)
    for i, point in enumerate(points):
        holding = np.flatnonzero((low[0] <= point[0]) & (point[0] <= high[0]))
        for axis in range(1, len(point)):
            sides = low[axis, holding], high[axis, holding]
            holding = holding[(sides[0] <= point[axis]) & (point[axis] <= sides[1])]
        if not len(holding):
            raise ValueError(f"no box holds {point}")
        found[i] = holding[0]
    return found


def _mixed(boxes: Boxes, rng: np.random.Generator) -> Indices:
    """All boxes, each once: the largest, the thinnest, any one, the next largest, and so on."""
    sizes = np.diff(boxes)[..., 0]
    orders = (-sizes.prod(1)).argsort(), sizes.min(1).argsort(), rng.permutation(len(boxes))
    mixed = np.stack(orders, 1).ravel()
    return mixed[np.sort(np.unique(mixed, return_index=True)[1])]


def _corners(boxes: Boxes) -> Points:
    """All corners, a hair inside. Shape: (boxes * 2^cubes, cubes)."""
    low, high = boxes[..., 0], boxes[..., 1]
    hair = np.minimum(HAIR, (high - low) / 4)
    ends = np.array(list(product((False, True), repeat=boxes.shape[1])))
    corners = np.where(ends, (high - hair)[:, None], (low + hair)[:, None])
    return corners.reshape(-1, boxes.shape[1])


def _random(boxes: Boxes, rng: np.random.Generator) -> Points:
    """A point in each box. Shape: (boxes, cubes)."""
    low, high = boxes[..., 0], boxes[..., 1]
    return low + rng.random(low.shape) * (high - low)


INSIDE, BORDER, ANYWHERE = "inside", "border", "anywhere"
_ROUNDS = 4
"""How often as many flights as a box has corners, and two more, go to each box at most."""


@dataclasses.dataclass(frozen=True)
class Places:
    """Placements; the first dimension counts them."""

    points: Points
    """Metres to the left of each cube. Shape: (k, cubes)."""
    outcome: NDArray[np.int64]  # (k,)
    """Number of the one that is stated; as many as there are where nothing is."""
    why: NDArray[np.str_]  # (k,)
    """INSIDE a box, near a BORDER of an outcome, or ANYWHERE."""


def draw_places(certificate: Certificate, count: int, rng: np.random.Generator) -> Places:
    """Draws places: up to a half in boxes of every outcome, a quarter at borders, others anywhere.

    Args:
        certificate: Whose boxes are a partition.
        count: Places.
        rng: Draws them.
    """
    groups = certificate.groups
    boxes = np.concatenate(groups)
    group = np.repeat(np.arange(len(groups)), [len(boxes) for boxes in groups])
    parts = [(p, np.full(len(p), i), INSIDE) for i, p in _inside(groups[:-1], count // 2, rng)]
    border = draw_borders(groups, certificate.bound, count // 4, rng)
    parts.append((border, group[find(boxes, border)], BORDER))
    points, chosen = draw_anywhere(boxes, count - sum(len(p) for p, *_ in parts), rng)
    parts.append((points, group[chosen], ANYWHERE))
    return Places(
        np.concatenate([points for points, *_ in parts]),
        np.concatenate([outcome for _, outcome, _ in parts]),
        np.repeat([why for *_, why in parts], [len(points) for points, *_ in parts]),
    )


def _inside(
    groups: list[Boxes], count: int, rng: np.random.Generator
) -> Iterator[tuple[int, Points]]:
    """As many points for each outcome, but that those of few boxes leave some to others."""
    order = sorted((len(boxes), i) for i, boxes in enumerate(groups) if len(boxes))
    for done, (num_boxes, i) in enumerate(order):
        enough = _ROUNDS * num_boxes * (2 ** groups[i].shape[1] + 2)
        share = min(enough, count // (len(order) - done))
        count -= share
        yield i, draw_inside(groups[i], share, rng)
