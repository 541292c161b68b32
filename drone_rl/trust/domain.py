"""The operating domain: the range of each axis in which the policy is good.

A search proposes a range: it starts without perturbation, moves outwards over the strengths of the
table while the policy is certainly good, and then divides the last gap into `PARTS`.

New episodes then test the range as a whole, at strengths drawn uniformly from it, one each. So they
succeed with the mean success rate over the range, whatever its shape, and the exact interval of
that rate holds however the range was proposed. Ranges of several axes are drawn jointly. The test
finds failures in a fraction of the range, or of the combinations, that `good_share` excludes;
smaller ones are allowed.
"""

import functools
from collections.abc import Callable, Mapping
from contextlib import closing
from typing import Any, NamedTuple

import numpy as np

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.sim.tasks import as_task
from drone_rl.trust.axes import Axis
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.rule import Quantity, Rule, VerdictKind
from drone_rl.trust.shifts_results import FailedEnd, Probe, Range, RangeTest, Side
from drone_rl.trust.suite import finite
from drone_rl.trust.verdict import kinds_of, measure
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion, rate_of

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
    return good_share * rate_of(oracle.success).upper95


class End(NamedTuple):
    """One end of a range, as strengths; None where there is none."""

    limit: float
    """The last one at which the policy is certainly good."""
    failed: tuple[float, Probe] | None
    """The first tested one at which it is not, and what was found."""
    bad: float | None
    """The first one at which it is certainly not."""
    is_open: bool | None
    """Whether none failed; None if the axis has none on this side."""


def walk(axis: Axis, sign: int, probe: Callable[[float], Probe]) -> End:
    """Find one end of a range.

    `sign` is 1 to search above the neutral strength, -1 below it. `probe` tests a strength.
    """
    limit, failed, bad = axis.neutral, None, None
    side = [strength for strength in axis.strengths if sign * axis.position(strength) > 0]
    for strength in sorted(side, key=lambda strength: abs(axis.position(strength))):
        found = probe(strength)
        if failed is None and found.good:
            limit = strength
            continue
        failed = failed or (strength, found)
        if found.bad:
            bad = strength
            break
    if failed is None:
        return End(limit, failed, bad, True if side else None)
    first, last = axis.position(limit), axis.position(failed[0])
    parts = (axis.at(first + part / PARTS * (last - first)) for part in range(1, PARTS))
    for strength in dict.fromkeys(part for part in parts if part not in (limit, failed[0])):
        found = probe(strength)
        if not found.good:
            bad = strength if found.bad else bad
            break
        limit = strength
    return End(limit, failed, bad, False)


def find_range(
    axis: Axis,
    of: Any,
    probe: Callable[[float], Probe],
    explain: Callable[[str, float, Probe], FailedEnd],
    test: Callable[[Mapping[Axis, Span]], RangeTest],
) -> Range:
    """Find the widest range of an axis and test it as a whole.

    Args:
        axis: The axis.
        of: The policy.
        probe: Tests a strength.
        explain: Returns the failure at an end: "low" or "high", the strength, what was found.
        test: Tests a range, see `run_across`.
    """

    def value(strength: float | None) -> float | None:
        return None if strength is None else finite(axis.value(strength, of))

    ends = {name: walk(axis, sign, probe) for name, sign in axis.signs.items()}
    found: dict[str, Any] = {}
    for name, end in ends.items():
        found |= {name: value(end.limit), f"{name}_bad": value(end.bad)}
        found[f"{name}_open"] = end.is_open
    low, high = sorted(axis.position(end.limit) for end in ends.values())
    return Range(
        **found,
        positions=(low, high),
        failed=tuple(explain(name, *end.failed) for name, end in ends.items() if end.failed),
        test=test({axis: (low, high)}) if low < high else None,
    )


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
        quantities = measure(greedy, baselines, rule)
        return Probe(
            good=is_surely_good(quantities, rule),
            bad=VerdictKind.GOOD not in kinds_of(quantities, rule),
            success=float(greedy.success.mean()),
            worst=_worst(quantities, rule),
        )

    def search(self, axis: Axis, test: Callable[[Mapping[Axis, Span]], RangeTest]) -> Range:
        """Find the widest range of an axis and test it as a whole, see `run_across`."""
        if not self.plain.good:
            return Range()
        subject = self._evaluator.subject
        return find_range(
            axis,
            subject,
            lambda strength: self.probe(axis.make(strength, subject)),
            functools.partial(self._explain, axis),
            test,
        )

    def _explain(self, axis: Axis, end: Any, strength: float, probed: Probe) -> FailedEnd:
        subject = self._evaluator.subject
        failed = FailedEnd(**dict(probed), end=end, value=finite(axis.value(strength, subject)))
        if probed.refused is not None:
            return failed
        seen = self._evaluator.rate_of_oracle(axis.make(strength, subject))
        is_impossible = seen is not None and seen.upper95 < self._possible
        return failed.replace(oracle=seen, impossible=is_impossible)


def is_surely_good(quantities: Mapping[str, Quantity], rule: Rule) -> bool:
    """Return whether the verdict is certainly good and certainly above all baselines."""
    sees = all(quantities[f"above {name}"].levels[0] > 0 for name in rule.blind_baselines)
    return sees and kinds_of(quantities, rule) == {VerdictKind.GOOD}


def _worst(quantities: Mapping[str, Quantity], rule: Rule) -> Side | None:
    """Return the stratum with the smallest fraction of goals reached, None if unknown."""
    shares = ((quantities[f"collected {name}"].value, name) for name in rule.strata)
    known = [(share, name) for share, name in shares if share is not None]
    if not known:
        return None
    share, side = min(known, key=lambda one: one[0])
    return Side(side=side, share=share)
