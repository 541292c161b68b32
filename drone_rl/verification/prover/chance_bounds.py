"""Bounds on the chances of a policy that draws its moves, wherever in a box the cubes stand.

With cubes in a box, a drone at a place may see many pictures; bounds on the network over all of
them bound how probable each move is, and a cube may be touched, or not. So the chain of one
placement becomes one whose probabilities lie in intervals (an interval Markov chain; Givan, Leach
and Dean, 2000), and the best and the worst that can come of it are found backwards, step by step.
"""

import dataclasses

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.prover.boxes import Boxes
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Place
from drone_rl.verification.prover.painting import Part
from drone_rl.verification.prover.ranges import Ranges
from drone_rl.verification.prover.subject import Subject

_LOST, _WON = 0, 1
_MOVES = (AHEAD, LEFT, RIGHT)
_BATCH = 512
ROUNDING = 1e-9
"""More than float64's errors of some hundred steps come to."""


@dataclasses.dataclass(frozen=True)
class Bounded:
    """Bounds on the probability that all cubes are collected, over a box of placements."""

    least: float
    """Nowhere in the box is it less."""
    most: float
    """Nowhere is it more."""
    mean_least: float
    """Nor is its mean over the box less than this,"""
    mean_most: float
    """or more than this."""


def bound_success(subject: Subject, box: Boxes, most: int = 1) -> Bounded:
    """How probable it is that all cubes are collected, wherever in a box they stand.

    Args:
        subject: Policy and task.
        box: Where the cubes may stand, metres to the left, the nearest first. Shape: (C, 2).
        most: Parts that the box is cut into, each where it helps the most: the smaller a part, the
            closer its bounds.

    Raises:
        InputError: See `Cells`.
    """
    looks = _Looks(subject, box)
    parts = [(box, *_bound(looks, box))]
    while len(parts) < most:
        gaps = [np.prod(np.diff(part)) * (high - low) for part, low, high in parts]
        part, low, high = parts[worst := int(np.argmax(gaps))]
        if high - low <= 2 * ROUNDING:
            break
        parts[worst : worst + 1] = [(half, *_bound(looks, half)) for half in _halves(part)]
    shares = [float(np.prod(np.diff(part)) / np.prod(np.diff(box))) for part, _, _ in parts]
    return Bounded(
        least=min(low for _, low, _ in parts),
        most=max(high for _, _, high in parts),
        mean_least=sum(share * low for share, (_, low, _) in zip(shares, parts, strict=True)),
        mean_most=sum(share * high for share, (_, _, high) in zip(shares, parts, strict=True)),
    )


def _halves(box: Boxes) -> tuple[Boxes, Boxes]:
    """Cut across the longest side."""
    cube = int(np.diff(box).argmax())
    first, second = box.copy(), box.copy()
    first[cube, 1] = second[cube, 0] = box[cube].mean()
    return first, second


def _bound(looks: "_Looks", box: Boxes) -> tuple[float, float]:
    places, targets = _reachable(looks.subject, box)
    lowest, highest = looks.probabilities(box, places)
    start = np.concatenate([[0.0, 1.0], np.zeros(len(places))])
    least, most = start, start
    for _ in range(looks.subject.lattice.task.step_limit):
        before = least, most
        least, most = start.copy(), start.copy()
        least[2:] = _extreme(before[0][targets].min(-1), lowest, highest)
        most[2:] = -_extreme(-before[1][targets].max(-1), lowest, highest)
        if all(map(np.array_equal, before, (least, most))):
            break
    return max(0.0, float(least[2]) - ROUNDING), min(1.0, float(most[2]) + ROUNDING)


def _reachable(subject: Subject, box: Boxes) -> tuple[list[Place], NDArray[np.int64]]:
    """All places, the start first, and where each move may lead.

    Returns:
        The places; and of each move the numbers of what may come of it, which are 0 for a loss, 1
        for a win, and two more than the place's own otherwise. Shape: (places, moves, ways).
    """
    lattice, number = subject.lattice, {Place(0, 0): 0}
    places, found = [Place(0, 0)], []
    for place in places:  # which grows
        for move in _MOVES:
            ways = []
            for moved, _ in lattice.move(place, move, box[None]):
                bare = dataclasses.replace(moved, steps=0, came=AHEAD)
                if (ending := lattice.ending(bare)) is not None:
                    ways.append(_WON if ending.reason == EndReason.ALL_CUBES else _LOST)
                    continue
                if bare not in number:
                    number[bare] = len(places)
                    places.append(bare)
                ways.append(2 + number[bare])
            found.append(ways)
    most = max(map(len, found))
    padded = [ways + ways[:1] * (most - len(ways)) for ways in found]
    return places, np.array(padded).reshape(len(places), len(_MOVES), most)


class _Looks:
    """What may be seen, and wished for, of cubes in a box and in its parts."""

    def __init__(self, subject: Subject, box: Boxes) -> None:
        self.subject, self._box = subject, box
        self._known: dict[tuple[int, int], tuple[Cells, Ranges]] = {}

    def probabilities(
        self, box: Boxes, places: list[Place]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How probable each move is, at least and at most. Shapes: (places, moves)."""
        lattice, painter = self.subject.lattice, self.subject.painter
        lowest, highest = np.zeros((2, len(places), len(_MOVES)))
        alike: dict[tuple[int, ...], list[int]] = {}
        for i, place in enumerate(places):
            alike.setdefault((place.ahead, *lattice.standing(place)), []).append(i)
        for (ahead, *cubes), numbers in alike.items():
            y = np.array([lattice.y(places[i]) for i in numbers])
            for some in np.array_split(np.arange(len(y)), -(-len(y) // _BATCH)):
                cases = [self._case(cube, ahead, box[cube], y[some]) for cube in cubes]
                lower, upper = map(painter.see, painter.paint(cases, len(some)))
                at = np.array(numbers)[some]
                bounds = self.subject.bounds.probabilities(lower, upper)
                lowest[at], highest[at] = (bound.numpy() for bound in bounds)
        return lowest, highest

    def _case(
        self, cube: int, ahead: int, interval: NDArray, y: NDArray
    ) -> tuple[Part, Tensor, Tensor]:
        """What `Painter.paint` takes of one cube, for drones at y."""
        cells, ranges = self._look(cube, ahead)
        first, last = cells.span(interval[0] - y, interval[1] - y)
        return ranges.part, *ranges.of(np.stack([cells.first[first], cells.last[last]], -1))

    def _look(self, cube: int, ahead: int) -> tuple[Cells, Ranges]:
        if (cube, ahead) not in self._known:
            task, (low, high) = self.subject.lattice.task, self._box[cube]
            aside = task.side_bound + task.step_length
            cells = self.subject.cells(cube, ahead, low - aside, high + aside)
            self._known[cube, ahead] = cells, Ranges(torch.from_numpy(cells.pictures))
        return self._known[cube, ahead]


def _extreme(
    values: NDArray[np.float64], lowest: NDArray[np.float64], highest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The least mean of values that probabilities between bounds allow. Shapes: (N, A) to (N,)."""
    order = values.argsort(-1)
    values, low, high = (np.take_along_axis(v, order, -1) for v in (values, lowest, highest))
    left = (1.0 - low.sum(-1)).clip(0.0)
    mean = (low * values).sum(-1)
    for k in range(values.shape[1]):
        more = np.minimum(high[:, k] - low[:, k], left)
        mean += more * values[:, k]
        left -= more
    return mean
