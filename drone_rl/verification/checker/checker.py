"""The check of a certificate: what it says goes together, and flights end as it says."""

import dataclasses
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import (
    Certificate,
    Outcome,
    read_certificate,
    refuse_another,
)
from drone_rl.verification.checker.consistency import find_lies, find_wrong_tallies, missing_steps
from drone_rl.verification.checker.rollouts import Flown, Simulator, Tell
from drone_rl.verification.checker.sampling import ANYWHERE, BORDER, INSIDE, draw_places

MOST_TOLD = 20
"""Lines about flights that ended otherwise."""
MOST_EXACT = 200
"""Flights that are also flown with the network in float64, about."""
MOST_KEPT = 1000
"""Such flights that are kept."""
_JUST_BEGUN = 2
"""Repetitions up to which going to and fro may count as such or not: it began with the end."""


@dataclasses.dataclass(frozen=True)
class Contradiction:
    """A flight that ended otherwise than stated."""

    where: str
    """Why it was flown: "inside" a box, at a "border", or "anywhere"."""
    placement: tuple[float, ...]
    """Metres to the left of each cube."""
    stated: str
    found: str

    def __str__(self) -> str:
        """One line."""
        return (
            f"from y={list(self.placement)} ({self.where}) the flight ended otherwise than "
            f"stated ({self.stated}): {self.found}"
        )


@dataclasses.dataclass(frozen=True)
class Findings:
    """What came of a check."""

    lies: tuple[str, ...]
    """What can't be or was refuted, besides single flights; one line each."""
    contradictions: tuple[Contradiction, ...]
    """The first of the flights that ended otherwise than stated."""
    contradicted: int
    """How many there were."""
    flights: Mapping[str, int]
    """Flown, by why."""

    @property
    def accepted(self) -> bool:
        """Whether nothing speaks against the certificate."""
        return not self.lies and not self.contradicted

    def lines(self) -> list[str]:
        """Each finding in one line."""
        told = [*self.lies, *map(str, self.contradictions[:MOST_TOLD])]
        more = self.contradicted - min(len(self.contradictions), MOST_TOLD)
        return [*told, f"and {more} flights more ended otherwise than stated"] if more else told

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in `check.json`."""
        return {
            "accepted": self.accepted,
            "findings": list(self.lies),
            "contradicted": self.contradicted,
            "contradictions": [dataclasses.asdict(c) for c in self.contradictions],
            "flights": dict(self.flights),
        }


def check_certificate(
    certificate: Certificate,
    weights: Mapping[str, torch.Tensor],
    *,
    flights: int = 2000,
    seed: int = 0,
    device: str = "cpu",
    renderer: str = "raytrace",
    tell: Tell = lambda done, total: None,
) -> Findings:
    """Checks a certificate that is of a policy with these weights, see `refuse_another`.

    What doesn't go together is refused without flights. For where these start see `draw_places`;
    places of which nothing is stated are left out.

    Args:
        certificate: Which.
        weights: Of its network.
        flights: How many, at most.
        seed: Of where they start.
        device: Where they are flown.
        renderer: Who draws, see `drone_rl.sim.rendering.find_renderer`.
        tell: Told now and then how many were flown, and of how many.

    Raises:
        InputError: There is no such device.
    """
    lies = tuple(find_lies(certificate))
    if lies:
        return Findings(lies, (), 0, {})
    drawn = draw_places(certificate, flights, np.random.default_rng(seed))
    stated = drawn.outcome < len(certificate.outcomes)
    simulator = Simulator(certificate.description, weights, device, renderer)
    with closing(simulator):
        flown = simulator.fly(drawn.points[stated], tell)
        some = np.arange(len(flown.end))[:: max(1, len(flown.end) // MOST_EXACT)]
        simulator.compute_in(torch.float64)
        exact = simulator.fly(drawn.points[stated][some])
    outcomes = [certificate.outcomes[i] for i in drawn.outcome[stated]]
    points, why = drawn.points[stated], drawn.why[stated]
    wrong = [i for i, outcome in enumerate(outcomes) if not ends_as_stated(outcome, flown, i)]
    lies = tuple(_depending_on_rounding([outcomes[i] for i in some], exact, np.isin(some, wrong)))
    steps = np.zeros_like(drawn.outcome)
    steps[stated] = flown.steps
    anywhere = drawn.why == ANYWHERE
    tallies = find_wrong_tallies(certificate.outcomes, drawn.outcome[anywhere], steps[anywhere])
    kept = [
        Contradiction(
            where=str(why[i]),
            placement=tuple(points[i].tolist()),
            stated=_stated(outcomes[i]),
            found=_found(flown, i),
        )
        for i in wrong[:MOST_KEPT]
    ]
    count = {kind: int((why == kind).sum()) for kind in (INSIDE, BORDER, ANYWHERE)}
    return Findings((*lies, *tallies), tuple(kept), len(wrong), count)


def _depending_on_rounding(
    stated: Sequence[Outcome], exact: Flown, is_wrong: NDArray[np.bool_]
) -> list[str]:
    """What float64 refutes: a proof holds for any order of sums, so for exact ones, too.

    Args:
        stated: How flights must end.
        exact: How they end with the network in float64.
        is_wrong: Those that end otherwise in float32, too. Shape: (k,).
    """
    ended = [ends_as_stated(outcome, exact, i) for i, outcome in enumerate(stated)]
    count = sum(not is_so for is_so, wrong in zip(ended, is_wrong, strict=True) if not wrong)
    if not count:
        return []
    return [
        f"{count} of {len(stated)} flights ended otherwise than stated with the network in float64 "
        "alone, so that the policy's decisions depend on rounding"
    ]


def ends_as_stated(outcome: Outcome, flown: Flown, i: int) -> bool:
    """Whether a flight ended as stated, and its number of steps is one of those stated.

    Args:
        outcome: What is stated.
        flown: Flights.
        i: Which of them.
    """
    if flown.end[i] != outcome.end or tuple(flown.collected[i]) != outcome.collected:
        return False
    if outcome.end == EndReason.STEP_LIMIT:
        loops = flown.repeats[i] > (0 if outcome.loops else _JUST_BEGUN)
        if loops != outcome.loops:
            return False
    return int(flown.steps[i]) in outcome.steps or missing_steps(outcome) > 0


def _stated(outcome: Outcome) -> str:
    steps = ", ".join(map(str, sorted(outcome.steps)))
    return f"{outcome}" if missing_steps(outcome) else f"{outcome}, steps: {steps}"


def _found(flown: Flown, i: int) -> str:
    end, collected = EndReason(flown.end[i]), tuple(map(bool, flown.collected[i]))
    loops = end == EndReason.STEP_LIMIT and bool(flown.repeats[i])
    as_outcome = Outcome(end, collected, loops, 0.0, {}, np.zeros((0, len(collected), 2)))
    return f"{as_outcome}, steps: {flown.steps[i]}"


def read_tried(
    path: Path, described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> Certificate:
    """A certificate of this very policy and task, whose boxes and shares go together exactly.

    That flights end as it states is not looked at, see `check_certificate`.

    Args:
        path: Of the file.
        described: The policy's description, in the task that counts.
        weights: Of its network.

    Raises:
        InputError: It can't be read, is of another network, camera or task, or contradicts itself.
    """
    certificate = read_certificate(path)
    refuse_another(certificate, described, weights, described.task)
    lie = next(find_lies(certificate), None)
    if lie is not None:
        raise InputError(f"certificate {path} contradicts itself: {lie}; prove the policy again")
    return certificate
