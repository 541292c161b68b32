"""What is known of the placements: of parts that are done, of the one under way, and together."""

import dataclasses
from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from drone_rl.verification.prover.boxes import Boxes, beyond, merge, ragged, volumes
from drone_rl.verification.prover.lattice import Ending

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
