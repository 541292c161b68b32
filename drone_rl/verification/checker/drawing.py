"""Which places a check flies from, and what is stated of each."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from drone_rl.verification.checker.certificate import Certificate
from drone_rl.verification.checker.places import (
    Boxes,
    Points,
    draw_anywhere,
    draw_borders,
    draw_inside,
    find,
)

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
