"""Follows all placements of the cubes at once through a policy's whole flight.

Places of the lattice are visited in an order in which none comes before one that leads to it. All
placements with which a drone comes to a place are there as boxes; the outlook cuts them by what the
policy does, and each part moves on. Where more than one action is possible, as far as is known, all
are followed, and what becomes of it counts as decided only if all end alike.
"""

import dataclasses
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.prover.action_table import Outlook, runs
from drone_rl.verification.prover.boxes import (
    Boxes,
    beyond,
    merge,
    ragged,
    settle,
    unite,
    volumes,
    whole,
)
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Ending, Place
from drone_rl.verification.prover.policy_spec import Subject, in_parts

MOST_STATED = 20_000
"""Boxes that are stated of a part under way; what they leave takes a few times as many."""

Ended = Mapping[tuple[Ending, int], Sequence[Boxes]]
"""Disjoint placements, by how they end and after how many steps."""


@dataclasses.dataclass
class Findings:
    """What is known of placements, so far or in the end; all of it is disjoint."""

    endings: dict[Ending, Boxes]
    """Placements that end so."""
    undecided: Boxes
    """The rest."""
    steps: dict[Ending, dict[int, float]]
    """Volume of each ending by number of steps, as far as that is certain."""

    @property
    def decided(self) -> float:
        """Volume of all endings."""
        return float(sum(volumes(boxes).sum() for boxes in self.endings.values()))


def undecided(boxes: Boxes) -> Findings:
    """Nothing is known there."""
    return Findings({}, boxes, {})


def ended(known: Ended, none: Boxes) -> Findings:
    """What is followed to its end, without forks.

    Args:
        known: See `Ended`.
        none: No boxes. Shape: (0, n, 2).
    """
    found = [undecided(none)]
    for (ending, steps), parts in known.items():
        boxes = np.concatenate(parts)
        found.append(
            Findings({ending: boxes}, none, {ending: {steps: float(volumes(boxes).sum())}})
        )
    return together(found)


def so_far(known: Ended, part: Boxes) -> Findings:
    """Of a part that is under way: the largest boxes of each ending; nothing else is decided.

    Many cubes have millions of boxes, which nobody could check one by one.

    Args:
        known: See `Ended`.
        part: The whole of it. Shape: (1, n, 2).
    """
    if not known:
        return undecided(part)
    each = [np.concatenate(parts) for parts in known.values()]
    boxes, owner = np.concatenate(each), np.repeat(range(len(each)), [len(b) for b in each])
    kinds = list(dict.fromkeys(ending for ending, _ in known))
    kind = np.array([kinds.index(ending) for ending, _ in known])[owner]
    order = np.lexsort((-volumes(boxes), kind))
    rank = ragged(np.bincount(kind))[1]
    largest = order[np.argsort(rank, kind="stable")][:MOST_STATED]
    while (left := beyond(boxes[largest], part)) is None:
        largest = largest[: len(largest) // 2]
    stated = {key: [boxes[largest[owner[largest] == i]]] for i, key in enumerate(known)}
    return together([ended(stated, part[:0]), undecided(left)])


def together(some: Sequence[Findings]) -> Findings:
    """Findings of disjoint placements, of as many cubes, as one."""
    endings: dict[Ending, list[Boxes]] = defaultdict(list)
    steps: dict[Ending, dict[int, float]] = defaultdict(dict)
    for found in some:
        for ending, boxes in found.endings.items():
            if len(boxes):
                endings[ending].append(boxes)
        for ending, volume in found.steps.items():
            for count, more in volume.items():
                steps[ending][count] = steps[ending].get(count, 0.0) + more
    return Findings(
        {ending: np.concatenate(boxes) for ending, boxes in endings.items()},
        np.concatenate([found.undecided for found in some]),
        dict(steps),
    )


def simplified(found: Findings, space: Boxes) -> Findings:
    """The same in fewer boxes: the largest part is what the others leave.

    Args:
        found: Disjoint boxes that are all of a space.
        space: That one. Shape: (1, n, 2).
    """
    endings = {ending: merge(boxes) for ending, boxes in found.endings.items()}
    left = merge(found.undecided)
    if endings:
        usual = max(endings, key=lambda e: volumes(endings[e]).sum())
        holes = np.concatenate([left, *(b for e, b in endings.items() if e != usual)])
        if (rest := beyond(holes, space)) is not None:
            endings[usual] = min(endings[usual], rest, key=len)
    return Findings(endings, left, found.steps)


MOST_ROWS = 20_000
"""Of the outlook's table that are cut in one go."""
MARGIN = 2.0
"""Metres by which an outlook reaches farther than what it is made for: drones move sideways."""

COARSE = 0.5
"""Metres to which it is known, of forks, where cubes stood that are gone."""


class Prover:
    """A proof on its way: advance it place by place, and ask for its findings at any time."""

    def __init__(self, subject: Subject, most_combinations: int = 500_000_000) -> None:
        """Begins with every placement at the start.

        Args:
            subject: Policy and task.
            most_combinations: Of pictures that are remembered at a time, about; where cubes have
                more, the placements are gone through in parts, one after the other.

        Raises:
            InputError: There would be too many parts.
        """
        self.lattice = subject.lattice
        self.parts = in_parts(subject, most_combinations)
        """Placements that are not yet begun with."""
        self.part = self.parts[:0]
        """Those under way; none between two parts."""
        self.done = undecided(self.parts[:0])
        """What is known of the parts before."""
        self.waiting: dict[Place, list[Boxes]] = defaultdict(list)
        self.ended: dict[tuple[Ending, int], list[Boxes]] = defaultdict(list)
        """Of the part under way, by number of steps."""
        self.forked: list[Boxes] = []
        """Where more than one action was possible for the first time, disjoint."""
        self.longest: dict[Place, int] = {}
        """The most steps that forks took to where they are; their places count none."""
        self.fork_ends: dict[Ending | None, list[Boxes]] = defaultdict(list)
        """What became of that; None for what is not followed to its end."""
        self.boxes_under_way = 0
        """Of all placements that are not yet followed to their end."""
        self.num_places = self.pictures = self.most_boxes = 0
        self.decided = 0.0
        """Volume of what is known: of the part under way, what ended without forks."""
        self.least_gap, self.largest_band = np.inf, 0.0
        self._subject, self._most = subject, most_combinations
        self._seen_from = -1
        self._foreseen: set[int] = set()
        self._cells: dict[int, Cells] = {}
        self._outlooks: dict[tuple[int, ...], Outlook] = {}
        self._record = np.zeros((32, 2), np.int64)

    @property
    def gap(self) -> float:
        """See `Bounds`."""
        return self._subject.bounds.gap

    @property
    def renderer(self) -> str:
        """Whose pictures the proof is about."""
        return type(self._subject.worlds.renderer).__name__

    @property
    def is_finished(self) -> bool:
        """Whether every placement has been followed to its end."""
        return not self.waiting and not len(self.parts)

    def advance(self) -> Place:
        """Visits the next place; returns it."""
        if not self.waiting:
            self.part, self.parts = self.parts[:1], self.parts[1:]
            self.wait(Place(0, 0), self.part)
        place = min(self.waiting, key=lambda p: p.turn)
        self._arrive(place.ahead)
        self._foresee(place)
        boxes = np.concatenate(self.waiting.pop(place))
        self.boxes_under_way -= len(boxes)
        boxes = unite(boxes) if place.is_fork else merge(boxes)
        if place.is_fork:
            place = dataclasses.replace(place, steps=self.longest.pop(place))
        self.num_places += 1
        self.most_boxes = max(self.most_boxes, len(boxes))
        for bits, part in self._cut(place, boxes):
            actions = [action for action in (AHEAD, LEFT, RIGHT) if bits >> action & 1]
            is_first_fork = len(actions) > 1 and not place.is_fork
            if is_first_fork:
                self.forked.append(part)
            origin = dataclasses.replace(place, is_fork=place.is_fork or is_first_fork)
            for action in actions:
                self._follow(origin, action, part)
        if not self.waiting:
            self._settle()
        return place

    def wait(self, place: Place, boxes: Boxes) -> None:
        """Notes placements that must be followed from a place on."""
        self.waiting[place].append(boxes)
        self.boxes_under_way += len(boxes)

    def _settle(self) -> None:
        """Settles the forks of a part that is done, and forgets how it came to that."""
        ways = {e: unite(np.concatenate(b)) for e, b in self.fork_ends.items() if e}
        unknown, num_cubes = self.fork_ends.get(None, []), self.lattice.task.num_cubes
        forks = Findings(*settle(self.forked, ways, unknown, num_cubes), {})
        found = together([ended(self.ended, self.part[:0]), forks])
        self.done = together([self.done, simplified(found, self.part)])
        self.decided = self.done.decided
        self.part = self.part[:0]
        for forgotten in (self.ended, self.forked, self.fork_ends):
            forgotten.clear()

    def _follow(self, place: Place, action: int, boxes: Boxes) -> None:
        """Moves on, unless that would be back to where the drone has just come from."""
        if {place.came, action} == {LEFT, RIGHT}:
            self._end(place, Ending(EndReason.STEP_LIMIT, place.collected, loops=True), boxes)
            return
        for moved, part in self.lattice.move(place, action, boxes):
            if ending := self.lattice.ending(moved):
                self._end(moved, ending, part)
            elif not moved.is_fork:
                self.wait(moved, part)
            else:
                self._gather(moved, part)

    def _gather(self, place: Place, boxes: Boxes) -> None:
        """Puts forks together however they came: what follows does not depend on it.

        Of steps, the most that any took are noted. Where cubes stood that are gone is rounded, so
        that it includes where they stood: that can only leave more undecided, within forks.
        """
        gone = [k for k in range(boxes.shape[1]) if k not in self.lattice.standing(place)]
        boxes = boxes.copy()
        boxes[:, gone, 0] = np.floor(boxes[:, gone, 0] / COARSE) * COARSE
        boxes[:, gone, 1] = np.ceil(boxes[:, gone, 1] / COARSE) * COARSE
        there = dataclasses.replace(place, steps=0)
        steps = max(place.steps, self.longest.get(there, 0))
        self.longest[there] = steps
        self.wait(there, boxes)

    def _end(self, place: Place, ending: Ending, boxes: Boxes) -> None:
        if place.is_fork:
            # who may go to and fro may also leave off at any time
            is_known = not ending.loops and ending.reason is not EndReason.STEP_LIMIT
            self.fork_ends[ending if is_known else None].append(boxes)
        else:
            steps = self.lattice.task.step_limit if ending.loops else place.steps
            self.ended[ending, steps].append(boxes)
            self.decided += float(volumes(boxes).sum())

    def _cut(self, place: Place, boxes: Boxes) -> Iterator[tuple[int, Boxes]]:
        """Boxes by the bits of the actions that are possible."""
        cubes, y = self.lattice.standing(place), self.lattice.y(place)
        seen = boxes[:, cubes] - y
        outlook = self._outlook(place, cubes, seen)
        if not cubes:
            yield outlook.nothing_in_sight(), boxes
            return
        spans = self._fill(outlook, seen)
        found: dict[int, list[Boxes]] = defaultdict(list)
        for owner, ranges, bits in runs(outlook, spans, MOST_ROWS):
            pieces = boxes[owner]
            for k, cube in enumerate(cubes):
                limits = outlook.cells[k].limits + y
                first, last = ranges[:, k].T
                pieces[:, cube, 0] = np.maximum(pieces[:, cube, 0], limits[first])
                pieces[:, cube, 1] = np.minimum(pieces[:, cube, 1], limits[last + 1])
            is_some = (pieces[..., 0] < pieces[..., 1]).all(-1)
            pieces, bits = pieces[is_some], bits[is_some]
            for kind in np.flatnonzero(np.bincount(bits)):
                found[int(kind)].append(merge(pieces[bits == kind]))
        for kind, parts in found.items():
            yield kind, merge(np.concatenate(parts))

    def _fill(self, outlook: Outlook, boxes: Boxes) -> NDArray[np.int64]:
        """Makes an outlook known there; returns the spans."""
        spans, pictures = outlook.spans(boxes), outlook.pictures
        outlook.fill(spans)
        self.pictures += outlook.pictures - pictures
        self.least_gap = min(self.least_gap, outlook.least_gap)
        return spans

    def _arrive(self, ahead: int) -> None:
        """Forgets what was seen from elsewhere than so many steps ahead."""
        if ahead != self._seen_from:
            self._seen_from = ahead
            self._foreseen.clear()
            self._outlooks.clear()
            self._cells.clear()

    def _foresee(self, place: Place) -> None:
        """Fills the outlook of all places beside one that were come to from behind.

        None of them leads to another one; many small batches would cost more than a large one.
        """
        if place.collected in self._foreseen or not (cubes := self.lattice.standing(place)):
            return
        self._foreseen.add(place.collected)
        beside = [
            np.concatenate(boxes)[:, cubes] - self.lattice.y(p)
            for p, boxes in self.waiting.items()
            if (p.ahead, p.collected, p.came) == (place.ahead, place.collected, AHEAD)
        ]
        if len(beside) > 1:
            boxes = merge(np.unique(np.concatenate(beside), axis=0))
            if self._is_within(self._looks(place, cubes, boxes)):
                self._fill(self._outlook(place, cubes, boxes), boxes)

    def _outlook(self, place: Place, cubes: list[int], boxes: Boxes) -> Outlook:
        """What is seen from the place's x, as far to the sides as boxes of cubes in sight reach."""
        cells = self._looks(place, cubes, boxes)
        if not self._is_within(cells):  # what is seen from elsewhere is of little use here
            ends = zip(boxes[..., 0].min(0), boxes[..., 1].max(0), strict=True)
            cells = [c.between(*end) for c, end in zip(cells, ends, strict=True)]
        known = self._outlooks.get(tuple(cubes))
        if known is None or known.cells != cells:
            known = Outlook(self._subject.bounds, self._subject.painter, cells, self._record)
            self._outlooks[tuple(cubes)] = known
        return known

    def _is_within(self, cells: list[Cells]) -> bool:
        """Whether the combinations of pictures are few enough to be remembered."""
        return math.prod(len(c.pictures) for c in cells) <= self._most

    def _looks(self, place: Place, cubes: list[int], boxes: Boxes) -> list[Cells]:
        """The cells of each cube in sight."""
        ends = zip(boxes[..., 0].min(0), boxes[..., 1].max(0), strict=True)
        return [self._look(place, k, *end) for k, end in zip(cubes, ends, strict=True)]

    def _look(self, place: Place, cube: int, lowest: float, highest: float) -> Cells:
        """The cells of one cube, at least from the lowest to the highest place."""
        known = self._cells.get(cube)
        if known is not None and known.limits[0] <= lowest and highest <= known.limits[-1]:
            return known
        if known is not None:
            lowest, highest = min(lowest, known.limits[0]), max(highest, known.limits[-1])
        found = self._subject.cells(cube, place.ahead, lowest - MARGIN, highest + MARGIN)
        bands = np.diff(found.limits)[1::2]
        self.largest_band = max(self.largest_band, float(bands.max(initial=0.0)))
        self._cells[cube] = found
        return found

    def findings(self) -> Findings:
        """What is known by now of all placements; nothing yet of forks of the part under way."""
        task = self.lattice.task
        found = [self.done, so_far(self.ended, self.part), undecided(self.parts)]
        return simplified(together(found), whole(task.lateral_bound, task.num_cubes))
