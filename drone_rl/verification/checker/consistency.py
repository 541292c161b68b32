"""Consistency of a certificate: an exact partition, exact fractions, possible outcomes.

Whether boxes partition a cube is decided without tolerance. The mixed derivative of a box's
indicator function is a sum of deltas at its corners, with sign plus where an even number of its
coordinates are upper ends. Functions that vanish far away are equal if and only if their
derivatives are; so boxes cover each point of the cube exactly once, and none outside, if and only
if their signed corners cancel except for those of the cube.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.intervals import proportion
from drone_rl.verification.checker.certificate import Certificate, Outcome


def volume(boxes: NDArray[np.float64]) -> Fraction:
    """Return the exact total volume of boxes, metres^n. Shape: (boxes, n, 2)."""
    if not len(boxes):
        return Fraction(0)
    borders, rank = np.unique(boxes, return_inverse=True)
    ratios = [border.as_integer_ratio() for border in borders.tolist()]
    unit = max(denominator for _, denominator in ratios)  # all are powers of two
    whole = np.array([n * (unit // d) for n, d in ratios], object)[rank.reshape(boxes.shape)]
    sizes = whole[..., 1] - whole[..., 0]
    return Fraction(int(sizes.prod(1).sum()), unit ** boxes.shape[1])


def find_partition_error(boxes: NDArray[np.float64], bound: float) -> list[float] | None:
    """Return a corner of a box next to which boxes do not partition [-bound, bound]^n.

    None if nonempty boxes, shape (boxes, n, 2), are a partition.
    """
    n = boxes.shape[1]
    every = np.concatenate([np.full((1, n, 2), (-bound, bound)), boxes])
    ranks = [np.unique(every[:, i], return_inverse=True)[1].reshape(-1, 2) for i in range(n)]
    ends = np.array(list(product((0, 1), repeat=n)))  # (2^n, n)
    sign = 1 - 2 * (ends.sum(1) % 2)
    key = np.zeros((len(every), len(ends)), np.int64)
    for i, rank in enumerate(ranks):  # corners by number; renumbered, so that none overflows
        key = key * (int(rank.max()) + 1) + rank[:, ends[:, i]]
        key = np.unique(key, return_inverse=True)[1].reshape(key.shape)
    weight = np.repeat(sign[None], len(every), 0)
    weight[0] *= -1  # the cube counts as negative
    sums = np.bincount(key.ravel(), weight.ravel())  # exact: sums of at most 2^25 ones
    uncancelled = np.flatnonzero(sums)
    if not len(uncancelled):
        return None
    box, end = np.argwhere(key == uncancelled[0])[0]
    return every[box, np.arange(n), ends[end]].tolist()


TOLERANCE = 1e-12  # relative error of a stated fraction from summing floats


def find_inconsistencies(certificate: Certificate) -> Iterator[str]:
    """Yield what is impossible, one line each."""
    whole = Fraction(2 * certificate.task.lateral_bound) ** certificate.task.num_cubes
    yield from _misfits(certificate, whole)
    seen: dict[tuple, int] = {}
    for i, outcome in enumerate(certificate.outcomes):
        key = (outcome.end, outcome.collected, outcome.loops)
        if seen.setdefault(key, i) != i:
            yield f"outcomes {seen[key]} and {i} are the same: {outcome}"
        wrong = [
            *_impossible(outcome, certificate.task.step_limit),
            *_wrong_share(outcome.share, volume(outcome.boxes) / whole),
        ]
        yield from (f"outcome {i} ({outcome}) {what}" for what in wrong)
    left = volume(certificate.undecided.boxes) / whole
    yield from (f"undecided {what}" for what in _wrong_share(certificate.undecided.share, left))
    if not certificate.finished and not left:
        yield "finished is false, but nothing is undecided"


def missing_steps(outcome: Outcome) -> float:
    """Return the fraction of placements with this outcome but no stated number of steps."""
    missing = outcome.share - sum(outcome.steps.values())
    return missing if missing > TOLERANCE * outcome.share else 0.0


def _misfits(certificate: Certificate, whole: Fraction) -> Iterator[str]:
    """Check twice that the boxes partition the placements: by corners and by volume."""
    boxes, bound = np.concatenate(certificate.groups), certificate.task.lateral_bound
    if (corner := find_partition_error(boxes, bound)) is not None:
        yield f"the boxes do not partition the placements next to {corner} (lateral_bound={bound})"
    if (total := volume(boxes)) != whole:
        yield f"the boxes have {float(total / whole):.17g} of the volume of all placements"


def _impossible(outcome: Outcome, step_limit: int) -> Iterator[str]:
    """Yield what the rules of the task exclude."""
    if outcome.is_success != all(outcome.collected):
        yield "can't be: a flight ends with all_cubes if and only if all are collected"
    if outcome.loops and outcome.end != "step_limit":
        yield "can't be: an oscillation ends at the step limit"
    if any(steps > step_limit for steps in outcome.steps):
        yield f"has more steps than step_limit={step_limit}"
    if outcome.end == "step_limit" and {*outcome.steps} - {step_limit}:
        yield f"has another number of steps than step_limit={step_limit}"
    if (total := sum(outcome.steps.values())) > outcome.share * (1 + TOLERANCE):
        yield f"has a share of {outcome.share!r}, but its steps add up to {total!r}"


def _wrong_share(stated: float, exact: Fraction) -> Iterator[str]:
    if abs(Fraction(stated) - exact) > Fraction(TOLERANCE) * exact:
        yield f"has a share of {stated!r}, but boxes of {float(exact)!r}"


DOUBT = 1e-9  # probability of refusing a true statement by chance, per number of steps


def find_wrong_step_counts(
    outcomes: Sequence[Outcome], owner: NDArray[np.int64], steps: NDArray[np.int64]
) -> Iterator[str]:
    """Yield the stated fractions of step counts that random episodes refute, one line each.

    `owner`, (episodes,), has the index of each episode's outcome, or the number of outcomes if no
    stated outcome is the episode's.
    """
    for i, outcome in enumerate(outcomes):
        here, missing = steps[owner == i], missing_steps(outcome)
        for number, stated in sorted(outcome.steps.items()):
            share = proportion(int((here == number).sum()), len(steps), 1 - DOUBT)
            if share.upper95 < stated or share.lower95 > stated + missing:
                yield (
                    f"outcome {i} ({outcome}) is said to take {number} steps from a share of "
                    f"{stated:.6g}, which {share.successes} of {share.trials} random flights "
                    "refute"
                )
        is_other = ~np.isin(here, list(outcome.steps))
        share = proportion(int(is_other.sum()), len(steps), 1 - DOUBT)
        if share.lower95 > missing:
            yield (
                f"outcome {i} ({outcome}) is said to take other numbers of steps than those stated "
                f"from a share of {missing:.6g}, which {share.successes} of {share.trials} "
                "random flights refute"
            )
