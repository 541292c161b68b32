"""Follow all placements of the cubes at once through a policy's whole episode."""

import dataclasses
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.verification.prover.action_table import ActionTable, runs
from drone_rl.verification.prover.boxes import (
    Boxes,
    all_placements,
    complement,
    merge,
    resolve_forks,
    union,
    volumes,
)
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Ending, LatticeState
from drone_rl.verification.prover.policy_spec import PolicySpec, partition_placements

MAX_STATED = 20_000
"""Boxes stated for a part in progress; their complement takes a few times as many."""
MAX_ROWS = 20_000  # rows of the action table cut at a time
MARGIN = 2.0  # metres by which a table extends beyond what is needed: drones move sideways
COARSE = 0.5  # metres to which forks record the positions of cubes that are gone

Ended = Mapping[tuple[Ending, int], Sequence[Boxes]]  # disjoint, by number of steps


@dataclasses.dataclass
class ProofFindings:
    """Known endings of disjoint sets of placements."""

    endings: dict[Ending, Boxes]
    undecided: Boxes
    steps: dict[Ending, dict[int, float]]  # volume of each ending by number of steps, where certain

    @property
    def decided(self) -> float:
        """Volume of all endings."""
        return float(sum(volumes(boxes).sum() for boxes in self.endings.values()))


class Prover:
    """A proof in progress; its findings are available at any time.

    Lattice states are visited in an order in which none precedes one that leads to it. Each holds
    the placements, as boxes, with which the drone arrives there. The action table cuts them by the
    possible actions, and each part moves on. Where several actions are possible, all are followed,
    and a placement counts as decided only if all its branches end alike.
    """

    def __init__(self, spec: PolicySpec, most_combinations: int = 500_000_000) -> None:
        """Start with all placements in parts of so many images, see `partition_placements`."""
        self.spec, self.lattice = spec, spec.lattice
        self.parts = partition_placements(spec, most_combinations)  # not yet started
        self.part = self.parts[:0]  # in progress, if any
        self.done = ProofFindings({}, self.parts[:0], {})  # findings of the parts before
        self.waiting: dict[LatticeState, list[Boxes]] = {}
        self.ended: dict[tuple[Ending, int], list[Boxes]] = {}
        """Of the part in progress, by number of steps."""
        self.forked: list[Boxes] = []  # placements with several possible actions for the first time
        self.longest: dict[LatticeState, int] = {}  # most steps of forks to each state
        self.fork_ends: dict[Ending | None, list[Boxes]] = {}  # by ending, if known
        self.boxes_under_way = 0  # boxes in all waiting states
        self.num_states = self.num_images = self.most_boxes = 0  # states, images, boxes of a state
        self.decided = 0.0  # volume known; of the part in progress, without forks
        self.least_gap, self.largest_band = np.inf, 0.0
        self._most = most_combinations
        self._seen_from = -1
        self._cells: dict[int, Cells] = {}
        self._tables: dict[tuple[int, ...], ActionTable] = {}
        self._record = np.zeros((32, 2), np.int64)

    @property
    def is_finished(self) -> bool:
        """Whether every placement has been followed to its end."""
        return not self.waiting and not len(self.parts)

    def advance(self) -> LatticeState:
        """Visit the next state and return it; the proof must not be finished."""
        if not self.waiting:
            self.part, self.parts = self.parts[:1], self.parts[1:]
            self.wait(LatticeState(0, 0), self.part)
        state = min(self.waiting, key=lambda p: p.turn)
        if state.ahead != self._seen_from:
            self._seen_from = state.ahead
            self._tables.clear()
            self._cells.clear()
        boxes = np.concatenate(self.waiting.pop(state))
        self.boxes_under_way -= len(boxes)
        boxes = union(boxes) if state.is_fork else merge(boxes)
        if state.is_fork:
            state = dataclasses.replace(state, steps=self.longest.pop(state))
        self.num_states += 1
        self.most_boxes = max(self.most_boxes, len(boxes))
        for bits, part in self._cut(state, boxes):
            actions = [action for action in (AHEAD, LEFT, RIGHT) if bits >> action & 1]
            is_first_fork = len(actions) > 1 and not state.is_fork
            if is_first_fork:
                self.forked.append(part)
            origin = dataclasses.replace(state, is_fork=state.is_fork or is_first_fork)
            for action in actions:
                self._follow(origin, action, part)
        if not self.waiting:
            self._finish_part()
        return state

    def wait(self, state: LatticeState, boxes: Boxes) -> None:
        """Add placements to be followed from a state."""
        self.waiting.setdefault(state, []).append(boxes)
        self.boxes_under_way += len(boxes)

    def findings(self) -> ProofFindings:
        """Return what is known of all placements, without forks of the part in progress."""
        task = self.lattice.task
        parts = [self.done, so_far(self.ended, self.part), ProofFindings({}, self.parts, {})]
        return simplified(combine(parts), all_placements(task.lateral_bound, task.num_cubes))

    def _finish_part(self) -> None:
        """Resolve the forks of a finished part and clear its records."""
        endings = {e: union(np.concatenate(b)) for e, b in self.fork_ends.items() if e}
        unknown, num_cubes = self.fork_ends.get(None, []), self.lattice.task.num_cubes
        forks = ProofFindings(*resolve_forks(self.forked, endings, unknown, num_cubes), {})
        findings = combine([ended(self.ended, self.part[:0]), forks])
        self.done = combine([self.done, simplified(findings, self.part)])
        self.decided = self.done.decided
        self.part = self.part[:0]
        for record in (self.ended, self.forked, self.fork_ends):
            record.clear()

    def _follow(self, state: LatticeState, action: int, boxes: Boxes) -> None:
        """Move on, or end the episode; returning where the drone came from is a loop."""
        if {state.came, action} == {LEFT, RIGHT}:
            self._end(state, Ending(CubesEnd.STEP_LIMIT, state.collected, loops=True), boxes)
            return
        for moved, part in self.lattice.move(state, action, boxes):
            if ending := self.lattice.ending(moved):
                self._end(moved, ending, part)
            elif not moved.is_fork:
                self.wait(moved, part)
            else:
                self._gather(moved, part)

    def _gather(self, state: LatticeState, boxes: Boxes) -> None:
        """Merge forks that reach a state by different paths, with the most steps of any."""
        # positions of cubes that are gone are rounded outwards: at worst more stays undecided
        gone = [k for k in range(boxes.shape[1]) if k not in self.lattice.standing(state)]
        boxes = boxes.copy()
        boxes[:, gone, 0] = np.floor(boxes[:, gone, 0] / COARSE) * COARSE
        boxes[:, gone, 1] = np.ceil(boxes[:, gone, 1] / COARSE) * COARSE
        there = dataclasses.replace(state, steps=0)
        self.longest[there] = max(state.steps, self.longest.get(there, 0))
        self.wait(there, boxes)

    def _end(self, state: LatticeState, ending: Ending, boxes: Boxes) -> None:
        if state.is_fork:  # a loop with an uncertain action may be left at any time
            is_known = not ending.loops and ending.reason is not CubesEnd.STEP_LIMIT
            self.fork_ends.setdefault(ending if is_known else None, []).append(boxes)
            return
        steps = self.lattice.task.step_limit if ending.loops else state.steps
        self.ended.setdefault((ending, steps), []).append(boxes)
        self.decided += float(volumes(boxes).sum())

    def _cut(self, state: LatticeState, boxes: Boxes) -> Iterator[tuple[int, Boxes]]:
        """Yield the bits of the possible actions and their part of the boxes."""
        cubes, y = self.lattice.standing(state), self.lattice.y(state)
        seen = boxes[:, cubes] - y
        table = self._table(state, cubes, seen)
        if not cubes:
            yield table.nothing_in_sight(), boxes
            return
        spans, num_images = table.spans(seen), table.num_images
        table.fill(spans)
        self.num_images += table.num_images - num_images
        self.least_gap = min(self.least_gap, table.least_gap)
        by_kind: dict[int, list[Boxes]] = defaultdict(list)
        for owner, ranges, bits in runs(table, spans, MAX_ROWS):
            pieces = boxes[owner]
            for k, cube in enumerate(cubes):
                limits = table.cells[k].limits + y
                (first, last), (begin, end) = ranges[:, k].T, spans[owner, k].T
                # the ends of a box stay, though they were rounded to find its cells
                low = np.where(first == begin, -np.inf, limits[first])
                high = np.where(last == end, np.inf, limits[last + 1])
                pieces[:, cube, 0] = np.maximum(pieces[:, cube, 0], low)
                pieces[:, cube, 1] = np.minimum(pieces[:, cube, 1], high)
            is_some = (pieces[..., 0] < pieces[..., 1]).all(-1)
            pieces, bits = pieces[is_some], bits[is_some]
            for kind in np.flatnonzero(np.bincount(bits)):
                by_kind[int(kind)].append(merge(pieces[bits == kind]))
        for kind, parts in by_kind.items():
            yield kind, merge(np.concatenate(parts))

    def _table(self, state: LatticeState, cubes: list[int], boxes: Boxes) -> ActionTable:
        """Return the table at the state's x, as far to the sides as the boxes reach."""
        ends = np.stack([boxes[..., 0].min(0), boxes[..., 1].max(0)], -1)
        cells = [self._cells_of(state, k, *end) for k, end in zip(cubes, ends, strict=True)]
        if math.prod(len(c.images) for c in cells) > self._most:
            # other states would profit little from a larger table
            cells = [c.between(*end) for c, end in zip(cells, ends, strict=True)]
        table = self._tables.get(tuple(cubes))
        if table is None or table.cells != cells:
            table = ActionTable(self.spec.bounds, self.spec.compositor, cells, self._record)
            self._tables[tuple(cubes)] = table
        return table

    def _cells_of(self, state: LatticeState, cube: int, lowest: float, highest: float) -> Cells:
        """Return the cells of one cube, at least from the lowest to the highest position."""
        if (cells := self._cells.get(cube)) is not None:
            if cells.limits[0] <= lowest and highest <= cells.limits[-1]:
                return cells
            lowest, highest = min(lowest, cells.limits[0]), max(highest, cells.limits[-1])
        cells = self.spec.cells(cube, state.ahead, lowest - MARGIN, highest + MARGIN)
        bands = np.diff(cells.limits)[1::2]
        self.largest_band = max(self.largest_band, float(bands.max(initial=0.0)))
        self._cells[cube] = cells
        return cells


def ended(endings: Ended, none: Boxes) -> ProofFindings:
    """Return the findings of placements followed to their end without forks."""
    findings = [ProofFindings({}, none, {})]
    for (ending, steps), parts in endings.items():
        volume = float(volumes(boxes := np.concatenate(parts)).sum())
        findings.append(ProofFindings({ending: boxes}, none, {ending: {steps: volume}}))
    return combine(findings)


def so_far(endings: Ended, part: Boxes) -> ProofFindings:
    """Return the largest boxes of a part in progress; the rest counts as undecided.

    Many cubes give millions of boxes, which nobody could check one by one.
    """
    if not endings:
        return ProofFindings({}, part, {})
    each = [np.concatenate(parts) for parts in endings.values()]
    boxes, owner = np.concatenate(each), np.repeat(range(len(each)), [len(b) for b in each])
    largest = np.argsort(-volumes(boxes), kind="stable")[:MAX_STATED]
    while (left := complement(boxes[largest], part)) is None:
        largest = largest[: len(largest) // 2]
    stated = {key: [boxes[largest[owner[largest] == i]]] for i, key in enumerate(endings)}
    return combine([ended(stated, part[:0]), ProofFindings({}, left, {})])


def combine(some: Sequence[ProofFindings]) -> ProofFindings:
    """Combine the findings of disjoint placements."""
    endings: dict[Ending, list[Boxes]] = defaultdict(list)
    steps: dict[Ending, dict[int, float]] = defaultdict(lambda: defaultdict(float))
    for findings in some:
        for ending, boxes in findings.endings.items():
            if len(boxes):
                endings[ending].append(boxes)
        for ending, volume in findings.steps.items():
            for count, more in volume.items():
                steps[ending][count] += more
    return ProofFindings(
        {ending: np.concatenate(boxes) for ending, boxes in endings.items()},
        np.concatenate([findings.undecided for findings in some]),
        {ending: dict(volume) for ending, volume in steps.items()},
    )


def simplified(findings: ProofFindings, space: Boxes) -> ProofFindings:
    """Reduce the boxes of a whole space: one ending becomes the complement of the others."""
    endings = {ending: merge(boxes) for ending, boxes in findings.endings.items()}
    left = merge(findings.undecided)
    if endings:
        usual = max(endings, key=lambda e: volumes(endings[e]).sum())
        holes = np.concatenate([left, *(b for e, b in endings.items() if e != usual)])
        if (rest := complement(holes, space)) is not None:
            endings[usual] = min(endings[usual], rest, key=len)
    return ProofFindings(endings, left, findings.steps)
