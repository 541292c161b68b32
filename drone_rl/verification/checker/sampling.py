"""Sample placements inside boxes, at borders, at the limits of all placements, and anywhere."""

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from drone_rl.verification.checker.certificate import Certificate

Boxes = NDArray[np.float64]  # lowest and highest y of each cube, metres. (boxes, cubes, 2)
Points = NDArray[np.float64]  # metres to the left of each cube. Shape: (points, cubes)
Indices = NDArray[np.intp]  # shape: (points,) or (boxes,)

CORNER_INSET = 1e-9  # metres by which corners are moved inwards
BORDER_OFFSET = 1e-4  # metres from a border to the points on both sides
_MAX_WORK = 2**31  # comparisons in the search for borders


def sample_inside(boxes: Boxes, count: int, rng: np.random.Generator) -> Points:
    """Return `count` centres, corners and random points of boxes.

    A centre of each box, in random order, for at most half of the points. Then all corners of as
    many boxes as half of the rest allows.
    """
    chosen = rng.permutation(boxes)
    centres = chosen[: -(-count // 2)].mean(-1)
    left = count - len(centres)
    num_corners = 2 ** boxes.shape[1]
    corners = _corners(chosen[: -(-left // (2 * num_corners))])[:left]
    rest = rng.integers(len(chosen), size=left - len(corners))
    return np.concatenate([centres, corners, _random(chosen[rest], rng)])


def sample_anywhere(boxes: Boxes, count: int, rng: np.random.Generator) -> tuple[Points, Indices]:
    """Return points uniform in the union of disjoint boxes, and the box of each."""
    sizes = np.diff(boxes)[..., 0].prod(1)
    chosen = rng.choice(len(boxes), count, p=sizes / sizes.sum())
    return _random(boxes[chosen], rng), chosen


def sample_borders(
    groups: Sequence[Boxes], bound: float, count: int, rng: np.random.Generator
) -> Points:
    """Return at most `count` points on both sides of faces between boxes of different groups."""
    boxes, sizes = np.concatenate(groups), np.array([len(group) for group in groups])
    tries = max(1, min(4 * count, _MAX_WORK // (4 * boxes.size)))
    some = rng.choice(np.flatnonzero(sizes), tries)
    chosen = boxes[(sizes.cumsum() - sizes)[some] + rng.integers(sizes[some])]
    row, axis = np.arange(tries), rng.integers(boxes.shape[1], size=tries)
    side = rng.integers(2, size=tries)
    on = _random(chosen, rng)
    on[row, axis] = chosen[row, axis, side]
    off = np.zeros_like(on)
    off[row, axis] = BORDER_OFFSET
    pairs = np.stack([on - off, on + off], 1)  # (tries, 2, cubes)
    pairs = pairs[(abs(pairs) < bound).all((1, 2))]
    owner = np.repeat(np.arange(len(groups)), sizes)[find(boxes, pairs.reshape(-1, boxes.shape[1]))]
    pairs = pairs[owner[::2] != owner[1::2]]
    new = np.sort(np.unique(pairs, axis=0, return_index=True)[1])  # of one cube there are few
    return pairs[new].reshape(-1, boxes.shape[1])[:count]


def find(boxes: Boxes, points: Points) -> Indices:
    """Return a box that holds each point, inside or on its border. Shape: (points,).

    Raises:
        ValueError: There is none.
    """
    low, high = (np.ascontiguousarray(boxes[..., end].T) for end in (0, 1))  # (cubes, boxes)
    indices = np.zeros(len(points), np.intp)
    for i, point in enumerate(points):
        holding = np.flatnonzero((low[0] <= point[0]) & (point[0] <= high[0]))
        for axis in range(1, len(point)):
            sides = low[axis, holding], high[axis, holding]
            holding = holding[(sides[0] <= point[axis]) & (point[axis] <= sides[1])]
        if not len(holding):
            raise ValueError(f"no box holds {point}")
        indices[i] = holding[0]
    return indices


def _corners(boxes: Boxes) -> Points:
    """Return all corners, slightly inside. Shape: (boxes * 2^cubes, cubes)."""
    low, high = boxes[..., 0], boxes[..., 1]
    hair = np.minimum(CORNER_INSET, (high - low) / 4)
    ends = np.array(list(product((False, True), repeat=boxes.shape[1])))
    corners = np.where(ends, (high - hair)[:, None], (low + hair)[:, None])
    return corners.reshape(-1, boxes.shape[1])


def _random(boxes: Boxes, rng: np.random.Generator) -> Points:
    """Return a random point in each box. Shape: (boxes, cubes)."""
    low, high = boxes[..., 0], boxes[..., 1]
    return low + rng.random(low.shape) * (high - low)


def sample_limits(bound: float, num_cubes: int, count: int, rng: np.random.Generator) -> Points:
    """Return `count` points of [-bound, bound]^num_cubes: its corners, then random edges and faces.

    Points after the corners have at least one coordinate at a limit; the others are random.
    """
    whole = np.full((1, num_cubes, 2), (-bound, bound))
    corners = _corners(whole)[:count]
    left = count - len(corners)
    points = _random(np.repeat(whole, left, 0), rng)
    is_at = rng.random(points.shape) < 0.5
    is_at[np.arange(left), rng.integers(num_cubes, size=left)] = True
    ends = np.where(rng.random(points.shape) < 0.5, -1, 1) * (bound - CORNER_INSET)
    return np.concatenate([corners, np.where(is_at, ends, points)])


INSIDE, BORDER, LIMIT, ANYWHERE = "inside", "border", "limit", "anywhere"
_ROUNDS = 4  # at most this many times 2^cubes + 2 episodes go to each box


@dataclasses.dataclass(frozen=True)
class Placements:
    """Placements; the first dimension counts them."""

    points: Points  # metres to the left of each cube. Shape: (k, cubes)
    outcome: NDArray[np.int64]  # (k,); index of the stated outcome; their number where none is
    why: NDArray[np.str_]
    """INSIDE a box, near a BORDER of an outcome, at a LIMIT of all placements, or ANYWHERE (k,)."""


def sample_placements(certificate: Certificate, count: int, rng: np.random.Generator) -> Placements:
    """Sample placements: three quarters or more anywhere, for the bound that they give.

    An eighth is in the outcomes' boxes, a sixteenth at borders and another one at limits.
    """
    groups, task = certificate.groups, certificate.task
    boxes = np.concatenate(groups)
    group = np.repeat(np.arange(len(groups)), [len(boxes) for boxes in groups])
    parts = [(p, np.full(len(p), i), INSIDE) for i, p in _inside(groups[:-1], count // 8, rng)]
    border = sample_borders(groups, task.lateral_bound, count // 16, rng)
    limits = sample_limits(task.lateral_bound, task.num_cubes, count // 16, rng)
    parts += [(p, group[find(boxes, p)], why) for p, why in ((border, BORDER), (limits, LIMIT))]
    points, chosen = sample_anywhere(boxes, count - sum(len(p) for p, *_ in parts), rng)
    parts.append((points, group[chosen], ANYWHERE))
    return Placements(
        np.concatenate([points for points, *_ in parts]),
        np.concatenate([outcome for _, outcome, _ in parts]),
        np.repeat([why for *_, why in parts], [len(points) for points, *_ in parts]),
    )


def _inside(
    groups: list[Boxes], count: int, rng: np.random.Generator
) -> Iterator[tuple[int, Points]]:
    """Yield equally many points for each outcome; outcomes of few boxes leave some to others."""
    order = sorted((len(boxes), i) for i, boxes in enumerate(groups) if len(boxes))
    for done, (num_boxes, i) in enumerate(order):
        enough = _ROUNDS * num_boxes * (2 ** groups[i].shape[1] + 2)
        share = min(enough, count // (len(order) - done))
        count -= share
        yield i, sample_inside(groups[i], share, rng)
