"""The operating domain: the range of each axis in which the policy is good with 95% confidence.

The search starts without perturbation and moves outwards. It tests every strength of the table and,
before each, a strength sampled at random between it and the previous one, to which a policy cannot
have been fitted. It stops at the first strength at which the policy is not certainly good, and then
tests the gap before that strength, divided into `PARTS`. Within a range, the policy is therefore
certainly good at every tested strength.

A range is wrong only if the policy passes the test at the first strength of a side at which it is
not truly good, or at the first such strength within the gap. Apart from the choice of the gap, both
strengths are fixed beforehand. The former test has the error probability of a side (`WALKING`), the
latter that of a gap (`REFINING`); both sides of an axis and all their gaps share 5%. The argument
assumes neither that episodes at different strengths are independent nor that a stronger
perturbation is worse.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.policies.baselines import OracleAgent, has_visible_oracle
from drone_rl.trust.agents import PolicyAgent
from drone_rl.trust.axes import Axis
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.rule import Quantity, Rule, VerdictKind, kinds_within
from drone_rl.trust.shifts_results import FailedEnd, Probe, Range, Side, TestedStrength
from drone_rl.trust.suite import finite
from drone_rl.trust.verdict import estimate, observe_each
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from drone_rl.utils.seeding import Stream, torch_generator

PARTS = 4
"""Equal parts of the gap at the end of a range; the strengths between them are tested."""
WALKING = 1 / 4
"""Fraction of an axis's error probability for the search of each of its two sides."""
REFINING = 1 / 20
"""Fraction for each of the ten gaps before the five strengths and the five sampled ones."""
_BETWEEN = 2000
"""Number of the random stream that samples strengths between those of the table."""


@dataclasses.dataclass
class End:
    """One end of a range."""

    limit: float
    """The last strength at which the policy is certainly good."""
    tested: list[tuple[float, bool]]
    """Tested strengths, and whether the policy is certainly good at each."""
    failed: float | None = None
    """The first strength of the outward search at which it is not; None if there is none."""


def walk(axis: Axis, sign: int, seed: int, is_good: Callable[[float, float], bool]) -> End:
    """Find one end of a range; the same answers give the same strengths.

    `sign` is 1 to search above the neutral strength, -1 below it. `is_good` takes a strength
    and the part of the axis's error that its answer may use; it returns whether the policy is
    certainly good there. The seed is that of the random strengths.
    """
    end = End(axis.neutral, [])

    def at(strength: float, part: float) -> bool:
        good = is_good(strength, part)
        end.tested.append((strength, good))
        if good:
            end.limit = strength
        return good

    for strength in _course(axis, _side(axis, sign), seed):
        if not at(strength, WALKING):
            end.failed = strength
            break
    if end.failed is None:
        return end
    parts = [part / PARTS for part in range(1, PARTS)]
    for strength in _inside(axis, end.limit, end.failed, parts):
        if not at(strength, REFINING):
            break
    return end


def range_of(axis: Axis, ends: Mapping[str, End], failed: Sequence[FailedEnd], of: Any) -> Range:
    """Return the result of `Prober.search` from the two ends by name."""

    def value(strength: float) -> float | None:
        return finite(axis.value(strength, of))

    tested = [(axis.position(s), value(s), good) for end in ends.values() for s, good in end.tested]
    low, high = sorted(axis.position(end.limit) for end in ends.values())
    return Range(
        **{name: value(end.limit) for name, end in ends.items()},
        **{f"{n}_open": e.failed is None if e.tested else None for n, e in ends.items()},
        positions=(low, high),
        failed=tuple(failed),
        flown=tuple(TestedStrength(position=p, value=v, good=g) for p, v, g in sorted(tested)),
    )


class Prober:
    """Test at which strengths a policy is certainly good."""

    def __init__(
        self,
        evaluator: PairedEvaluator,
        oracle: CompleteEpisodes,
        good_share: float,
        possible_share: float = 0.9,
        plain_part: float = WALKING,
    ) -> None:
        """Test the policy without perturbation, with this part of the axis's error.

        `oracle` are episodes of the task's oracle without perturbation; see `Rule` for `good_share`
        and `Suite` for `possible_share`.
        """
        task = oracle.task
        self._evaluator, self._oracle, self._possible = evaluator, oracle, possible_share
        self._rule = Rule(
            good_share=good_share, strata=task.strata, blind_baselines=task.blind_baselines
        )
        self._baselines: dict[Any, dict[str, CompleteEpisodes]] = {}
        self.plain = self.probe(Condition(), plain_part)

    def rule_at(self, part: float) -> Rule:
        """Return the rule with this fraction of an axis's error probability."""
        return self._rule.replace(error_rate=part * self._rule.error_rate)

    def probe(self, condition: Condition, part: float) -> Probe:
        """Test whether the policy is certainly good under a condition.

        That is, the verdict is certainly good, and the policy is certainly better than the random
        and constant baselines, however easy the condition makes the task. Episodes that depend on
        rounding count as failures for "good", and as successes for "bad". The test may use this
        part of the axis's error.
        """
        try:
            key = self._evaluator.settings(condition)
        except InputError as error:
            return Probe(good=False, bad=True, refused=str(error))
        subject = self._evaluator.subject
        agent = PolicyAgent(subject.network, examines_rounding=True)
        greedy = self._evaluator.run(condition, agent=agent).episodes
        if key not in self._baselines:  # of task and camera, nearly
            self._baselines[key] = self._evaluator.run_baselines(condition)
        rule = self.rule_at(part)
        baselines = {**self._baselines[key], "oracle": self._oracle}
        quantities = measure_open(greedy, baselines, rule, agent.is_fragile)
        return Probe(
            good=is_surely_good(quantities, rule),
            bad=VerdictKind.GOOD not in _kinds(quantities, rule),
            success=float(greedy.success.mean()),
            fragile=int(agent.is_fragile.sum()),
            worst=_worst(quantities, rule),
        )

    def search(self, axis: Axis) -> Range:
        """Find the widest range of an axis."""
        if not self.plain.good:
            return Range()
        probed: dict[float, Probe] = {}

        def is_good(strength: float, part: float) -> bool:
            condition = axis.make(strength, self._evaluator.subject)
            probed[strength] = self.probe(condition, part)
            return probed[strength].good

        signs = axis.signs.items()
        ends = {name: walk(axis, sign, self._evaluator.seed, is_good) for name, sign in signs}
        failed = [
            self._explain(axis, name, end.failed, probed[end.failed])
            for name, end in ends.items()
            if end.failed is not None
        ]
        return range_of(axis, ends, failed, self._evaluator.subject)

    def _explain(self, axis: Axis, end: Any, strength: float, probed: Probe) -> FailedEnd:
        value = finite(axis.value(strength, self._evaluator.subject))
        failed = FailedEnd(**dict(probed), end=end, value=value)
        if probed.refused is not None or not has_visible_oracle(self._oracle.task):
            return failed
        condition = axis.make(strength, self._evaluator.subject)
        agent = OracleAgent(only_visible=True)
        success = self._evaluator.run(condition, agent=agent).episodes.success
        seen = proportion(int(success.sum()), len(success))
        return failed.replace(oracle=seen, impossible=seen.upper95 < self._possible)


def measure_open(
    greedy: CompleteEpisodes, baselines: Mapping[str, CompleteEpisodes], rule: Rule, is_open: Tensor
) -> dict[str, Quantity]:
    """Return a rule's quantities, with intervals that hold for any outcomes of open episodes.

    Lower bounds count the worst value of a quantity in these episodes, (n,), bool, upper bounds the
    best one.
    """
    quantities = {}
    observed, rows = observe_each(greedy, baselines, rule), is_open.numpy()
    for i, (name, values) in enumerate(zip(rule.quantities, observed, strict=True)):
        middle, least, most = (
            estimate(i, one[~np.isnan(one)], rule)
            for one in (values, *(np.where(rows, end, values) for end in rule.ranges[i]))
        )
        low, high = min(middle.lower, least.lower), max(middle.upper, most.upper)
        quantities[name] = middle.replace(lower=low, upper=high)
    return quantities


def is_surely_good(quantities: Mapping[str, Quantity], rule: Rule) -> bool:
    """Return whether the verdict is certainly good and certainly above all baselines."""
    sees = all(quantities[f"above {name}"].levels[0] > 0 for name in rule.blind_baselines)
    return sees and _kinds(quantities, rule) == {VerdictKind.GOOD}


def _kinds(quantities: Mapping[str, Quantity], rule: Rule) -> frozenset[VerdictKind]:
    """Return all kinds that the intervals admit."""
    box = tuple(quantity.levels for quantity in quantities.values())
    return kinds_within(box, len(rule.strata))


def _worst(quantities: Mapping[str, Quantity], rule: Rule) -> Side | None:
    """Return the stratum with the smallest fraction of goals reached, None if unknown."""
    shares = {s: quantities[f"collected {s}"].value for s in rule.strata}
    rates = {stratum: share for stratum, share in shares.items() if share is not None}
    if not rates:
        return None
    side = min(rates, key=lambda stratum: rates[stratum])
    return Side(side=side, share=rates[side])


def _course(axis: Axis, side: list[float], seed: int) -> Iterator[float]:
    """Yield the strengths of one side, weakest first, each after a randomly sampled one."""
    generator = torch_generator(seed, Stream.SHIFTS, number=_BETWEEN)
    shares = torch.rand(len(axis.strengths), generator=generator, dtype=torch.float64)
    before = axis.neutral
    for strength, share in zip(side, shares.tolist(), strict=False):
        yield from _inside(axis, before, strength, [share])
        yield strength
        before = strength


def _side(axis: Axis, sign: int) -> list[float]:
    """Return the table's strengths on one side of the neutral value, weakest first."""
    there = [strength for strength in axis.strengths if sign * axis.position(strength) > 0]
    return sorted(there, key=lambda strength: abs(axis.position(strength)))


def _inside(axis: Axis, near: float, far: float, shares: list[float]) -> list[float]:
    """Return strengths between two others at given fractions, without duplicates."""
    there = (axis.between(near, far, share) for share in shares)
    return list(dict.fromkeys(strength for strength in there if strength is not None))
