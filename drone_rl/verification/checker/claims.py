"""What a certificate says must go together, before any flight: shares, outcomes, the partition."""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.checker.certificate import Certificate, Outcome
from drone_rl.verification.checker.partition import find_misfit, volume

MOST_MISSING = 0.05
"""Of the stated placements, those whose number of steps may be left open."""
FEWEST_STATED = 1e-3
"""Share of the placements from which on an outcome has to state a number of steps."""
TOLERANCE = 1e-12
"""Of a stated share, relative to the exact one: what adding up floats may lose."""


def find_lies(certificate: Certificate) -> Iterator[str]:
    """What can't be, one line each.

    Args:
        certificate: Which.
    """
    whole = Fraction(2 * certificate.bound) ** certificate.task.num_cubes
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
    yield from _missing(certificate)
    left = volume(certificate.undecided) / whole
    yield from (f"undecided {what}" for what in _wrong_share(certificate.undecided_share, left))
    if not certificate.finished and not left:
        yield "finished is false, but nothing is undecided"


def missing_steps(outcome: Outcome) -> float:
    """Share of the placements with this outcome whose number of steps is not stated; 0 for none."""
    missing = outcome.share - sum(outcome.steps.values())
    return missing if missing > TOLERANCE * outcome.share else 0.0


def _missing(certificate: Certificate) -> Iterator[str]:
    """Numbers of steps that are left open, which no check could hold against a rollout."""
    for i, outcome in enumerate(certificate.outcomes):
        if not outcome.steps and outcome.share > FEWEST_STATED:
            yield f"outcome {i} ({outcome}) states no number of steps"
    stated = sum(outcome.share for outcome in certificate.outcomes)
    missing = sum(map(missing_steps, certificate.outcomes))
    if missing > MOST_MISSING * stated:
        yield f"numbers of steps are left open for a share of {missing:.6g} of all placements"


def _misfits(certificate: Certificate, whole: Fraction) -> Iterator[str]:
    """Whether the boxes are a partition of the placements; told twice, by corners and volumes."""
    boxes = np.concatenate(certificate.groups)
    misfit = find_misfit(boxes, certificate.bound)
    if misfit is not None:
        place, count = misfit
        yield (
            f"the boxes are no partition of the placements: {count} of them hold the place "
            f"{place}, where lateral_bound={certificate.bound}"
        )
    if (total := volume(boxes)) != whole:
        yield f"the boxes have {float(total / whole):.17g} of the volume of all placements"


def _impossible(outcome: Outcome, step_limit: int) -> Iterator[str]:
    """What the rules of the task don't allow."""
    if (outcome.end == EndReason.ALL_CUBES) != all(outcome.collected):
        yield "can't be: a flight ends with all_cubes if and only if all are collected"
    if outcome.loops and outcome.end != EndReason.STEP_LIMIT:
        yield "can't be: going to and fro ends at the step limit"
    if any(steps > step_limit for steps in outcome.steps):
        yield f"has more steps than step_limit={step_limit}"
    if outcome.end == EndReason.STEP_LIMIT and {*outcome.steps} - {step_limit}:
        yield f"has another number of steps than step_limit={step_limit}"
    if (total := sum(outcome.steps.values())) > outcome.share * (1 + TOLERANCE):
        yield f"has a share of {outcome.share!r}, but its steps add up to {total!r}"


def _wrong_share(stated: float, exact: Fraction) -> Iterator[str]:
    if abs(Fraction(stated) - exact) > Fraction(TOLERANCE) * exact:
        yield f"has a share of {stated!r}, but boxes of {float(exact)!r}"
