"""A task in parts, none of which has more pictures than can be remembered at a time.

The pictures of several cubes are the combinations of their own: with each cube there are a few
hundred times as many. So the placements of the farthest cubes are cut into strips.
"""

import math

import numpy as np

from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import Boxes, whole
from drone_rl.verification.prover.silhouettes import camera_ahead
from drone_rl.verification.prover.subject import Subject

PICTURES = 3
"""About so many pictures there are for each border: beside it, and within its band."""
MOST_PARTS = 1_000
"""A task of more would take days."""


def pictures_of_each(subject: Subject) -> list[int]:
    """About how many pictures each cube has alone where together they have the most."""
    lattice, found = subject.lattice, []
    for steps in range(lattice.last):
        away = lattice.cubes - steps * lattice.task.step_length
        found.append([_count(subject, ahead) if ahead >= 0 else 1 for ahead in away])
    return max(found, key=math.prod)


def _count(subject: Subject, away: float) -> int:
    """About how many pictures a cube has within the placements, metres ahead of the drone."""
    places, _ = subject.eye.borders(away - camera_ahead())
    return 1 + PICTURES * int((np.abs(places) <= subject.lattice.task.lateral_bound).sum())


def in_parts(subject: Subject, most: int) -> Boxes:
    """Cuts all placements.

    Args:
        subject: Policy and task.
        most: Combinations of pictures of a part, about.

    Returns:
        Disjoint boxes that are all placements. Shape: (N, num_cubes, 2).

    Raises:
        InputError: There are too many.
    """
    counts = pictures_of_each(subject)
    strips, total = [1] * len(counts), math.prod(counts)
    for cube in reversed(range(len(counts))):
        left = math.prod(n / s for n, s in zip(counts, strips, strict=True))
        strips[cube] = min(counts[cube], max(1, math.ceil(left / most)))
    if math.prod(strips) > MOST_PARTS:
        raise InputError(
            f"task.num_cubes={len(counts)} gives about {total:.0e} combinations of pictures, in "
            f"{math.prod(strips):,} parts, which would take days; give fewer cubes, a smaller "
            "task.lateral_bound, or a policy whose camera has fewer pixels"
        )
    boxes = whole(subject.lattice.task.lateral_bound, len(counts))
    for cube, count in enumerate(strips):
        low, high = boxes[0, cube, 0], boxes[-1, cube, 1]
        ends = np.linspace(low, high, count + 1)
        boxes = np.repeat(boxes, count, 0)
        boxes[:, cube, 0] = np.tile(ends[:-1], len(boxes) // count)
        boxes[:, cube, 1] = np.tile(ends[1:], len(boxes) // count)
    return boxes
