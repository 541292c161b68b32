"""The operating domain: the range of each axis in which the policy is good.

A search proposes a range: it starts without perturbation, moves outwards over the strengths of the
table while the policy is certainly good, and then divides the last gap into `PARTS`.

New episodes then test the range as a whole, at strengths drawn uniformly from it, one each. So they
succeed with the mean success rate over the range, whatever its shape, and the exact interval of
that rate holds however the range was proposed. Ranges of several axes are drawn jointly. The test
finds failures in a fraction of the range, or of the combinations, that `good_share` excludes;
smaller ones are allowed.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import Any

import numpy as np

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.policies.baselines import OracleAgent, has_visible_oracle
from drone_rl.sim.tasks import as_task
from drone_rl.trust.axes import Axis
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.rule import Quantity, Rule, VerdictKind, kinds_within
from drone_rl.trust.shifts_results import FailedEnd, Probe, Range, RangeTest, Side, TestedStrength
from drone_rl.trust.suite import finite
from drone_rl.trust.verdict import measure
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion

PARTS = 4
"""Equal parts of the gap at the end of a range; the strengths between them are tested."""
EXAMPLES = 3
"""Failures of which the strengths are kept."""
Span = tuple[float, float]
"""A range of positions on an axis, lower first."""


def run_across(
    subject: EvaluatedPolicy,
    spans: Mapping[Axis, Span],
    episodes: int,
    seed: int,
    required: float,
) -> RangeTest:
    """Run episodes at strengths drawn uniformly and jointly from ranges, one each.

    Each episode runs alone, as a drone flies, so a policy counts by what it does alone.

    Args:
        subject: The policy.
        spans: The ranges by axis.
        episodes: How many.
        seed: Root of all random streams.
        required: Success rate to exceed.
    """
    rng, successes, failed = np.random.default_rng(seed), 0, []
    with closing(PairedEvaluator(subject, 1)) as evaluator:
        for root in rng.integers(2**32, size=episodes).tolist():
            evaluator.sample(root)
            strengths = {axis: axis.sample(*span, rng) for axis, span in spans.items()}
            condition = Condition()
            for axis, strength in strengths.items():
                if axis.position(strength):
                    condition |= axis.make(strength, subject)
            try:
                is_success = bool(evaluator.run(condition).episodes.success)
            except InputError as error:
                return RangeTest(success=proportion(0, 0), required=required, refused=str(error))
            successes += is_success
            if not is_success and len(failed) < EXAMPLES:
                failed.append({a.name: finite(a.value(s, subject)) for a, s in strengths.items()})
    success = proportion(successes, episodes)
    return RangeTest(success=success, required=required, failed=tuple(failed))


def required_success(oracle: CompleteEpisodes | None, good_share: float) -> float:
    """Return the success rate that a good policy exceeds, given a usable oracle's episodes."""
    if oracle is None:
        return good_share
    return good_share * proportion(int(oracle.success.sum()), len(oracle)).upper95


@dataclasses.dataclass
class End:
    """One end of a range."""

    limit: float
    """The last strength at which the policy is certainly good."""
    failed: float | None = None
    """The first tested strength at which it is not; None if there is none."""
    bad: float | None = None
    """The first at which it is certainly not; None if there is none."""
    tested: dict[float, Probe] = dataclasses.field(default_factory=dict)
    """By tested strength, what was found."""


def walk(axis: Axis, sign: int, probe: Callable[[float], Probe]) -> End:
    """Find one end of a range.

    `sign` is 1 to search above the neutral strength, -1 below it. `probe` tests a strength.
    """
    end = End(axis.neutral)
    side = [strength for strength in axis.strengths if sign * axis.position(strength) > 0]
    for strength in sorted(side, key=lambda strength: abs(axis.position(strength))):
        found = end.tested[strength] = probe(strength)
        if end.failed is None and found.good:
            end.limit = strength
            continue
        end.failed = strength if end.failed is None else end.failed
        if found.bad:
            end.bad = strength
            break
    if end.failed is None:
        return end
    parts = (axis.between(end.limit, end.failed, part / PARTS) for part in range(1, PARTS))
    for strength in dict.fromkeys(part for part in parts if part is not None):
        found = end.tested[strength] = probe(strength)
        if not found.good:
            end.bad = strength if found.bad else end.bad
            break
        end.limit = strength
    return end


def range_of(
    axis: Axis,
    ends: Mapping[str, End],
    failed: Sequence[FailedEnd],
    of: Any,
    test: RangeTest | None = None,
) -> Range:
    """Return the result of `Prober.search` from the two ends by name."""

    def value(strength: float | None) -> float | None:
        return None if strength is None else finite(axis.value(strength, of))

    tested = sorted(
        (axis.position(strength), value(strength), probe.good)
        for end in ends.values()
        for strength, probe in end.tested.items()
    )
    return Range(
        **{name: value(end.limit) for name, end in ends.items()},
        **{f"{n}_open": e.failed is None if e.tested else None for n, e in ends.items()},
        **{f"{name}_bad": value(end.bad) for name, end in ends.items()},
        positions=_span(axis, ends),
        failed=tuple(failed),
        flown=tuple(TestedStrength(position=p, value=v, good=g) for p, v, g in tested),
        test=test,
    )


def _span(axis: Axis, ends: Mapping[str, End]) -> Span:
    low, high = sorted(axis.position(end.limit) for end in ends.values())
    return low, high


class Prober:
    """Test at which strengths a policy is certainly good."""

    def __init__(
        self,
        evaluator: PairedEvaluator,
        oracle: CompleteEpisodes | None,
        good_share: float,
        possible_share: float = 0.9,
    ) -> None:
        """Test the policy without perturbation.

        `oracle` is from `PairedEvaluator.run_oracle`; see `Rule` for `good_share` and `Suite` for
        `possible_share`.
        """
        task = as_task(evaluator.subject.task)
        self._evaluator, self._oracle, self._possible = evaluator, oracle, possible_share
        self._rule = Rule(
            good_share=good_share, strata=task.strata, blind_baselines=task.blind_baselines
        )
        self._baselines: dict[Any, dict[str, CompleteEpisodes]] = {}
        self.plain = self.probe(Condition())

    def probe(self, condition: Condition) -> Probe:
        """Test whether the policy is certainly good under a condition.

        That is, the verdict is certainly good, and the policy is certainly better than the random
        and constant baselines, however easy the condition makes the task.
        """
        try:
            key = self._evaluator.settings(condition)
        except InputError as error:
            return Probe(good=False, bad=True, refused=str(error))
        greedy = self._evaluator.run(condition).episodes
        if key not in self._baselines:  # of task and camera, nearly
            self._baselines[key] = self._evaluator.run_baselines(condition)
        rule, baselines = self._rule, self._baselines[key]
        if self._oracle is not None:
            baselines = {**baselines, "oracle": self._oracle}
        quantities = dict(zip(rule.quantities, measure(greedy, baselines, rule), strict=True))
        return Probe(
            good=is_surely_good(quantities, rule),
            bad=VerdictKind.GOOD not in _kinds(quantities, rule),
            success=float(greedy.success.mean()),
            worst=_worst(quantities, rule),
        )

    def search(self, axis: Axis, test: Callable[[Mapping[Axis, Span]], RangeTest]) -> Range:
        """Find the widest range of an axis and test it as a whole, see `run_across`."""
        if not self.plain.good:
            return Range()
        subject = self._evaluator.subject

        def probe(strength: float) -> Probe:
            return self.probe(axis.make(strength, subject))

        ends = {name: walk(axis, sign, probe) for name, sign in axis.signs.items()}
        failed = [
            self._explain(axis, name, end.failed, end.tested[end.failed])
            for name, end in ends.items()
            if end.failed is not None
        ]
        low, high = _span(axis, ends)
        return range_of(
            axis, ends, failed, subject, test({axis: (low, high)}) if low < high else None
        )

    def _explain(self, axis: Axis, end: Any, strength: float, probed: Probe) -> FailedEnd:
        value = finite(axis.value(strength, self._evaluator.subject))
        failed = FailedEnd(**dict(probed), end=end, value=value)
        task = as_task(self._evaluator.subject.task)
        if probed.refused is not None or not has_visible_oracle(task):
            return failed
        condition = axis.make(strength, self._evaluator.subject)
        seeing = OracleAgent(only_visible=True)
        success = self._evaluator.run(condition, agent=seeing).episodes.success
        seen = proportion(int(success.sum()), len(success))
        return failed.replace(oracle=seen, impossible=seen.upper95 < self._possible)


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
