"""The operating domain: how far each axis may go while the policy surely stays good.

From no difference outwards a course is flown: every strength of the table and, before each, one
that is drawn at random between it and the one before, which nobody can have prepared for. Where the
policy is not surely good the course ends, whatever would follow; the gap before that strength is
gone through once more, in `PARTS` steps. So all that was flown within a range was surely good.

That is certain whatever lies where. A range is wrong only if the first strength of a course that is
not good in truth passes, or the first such strength within the gap that is gone through. Both are
known before anything is flown, but for which gap it is: the former may pass with the error of a
course (`WALKING`), the latter with that of a gap (`REFINING`), and both ends of an axis, with all
their gaps, share 5%. Nothing is assumed of how flights at different strengths depend on each other,
nor that what is stronger is worse.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.evaluation.judge import measure, widen
from drone_rl.evaluation.metrics import Episodes
from drone_rl.evaluation.outcomes import Outcomes
from drone_rl.evaluation.rule import Kind, Quantity, Rule, kinds_within
from drone_rl.robustness.agents import OracleAgent, PolicyAgent, has_oracle
from drone_rl.robustness.axes import Axis
from drone_rl.robustness.paired_evaluation import PairedEvaluator
from drone_rl.robustness.perturbations import Condition
from drone_rl.robustness.suite import finite
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from drone_rl.utils.seeding import Stream, torch_generator

PARTS = 4
"""Of the gap in which a range ends."""
WALKING = 1 / 4
"""Of an axis's error, for each of two courses."""
REFINING = 1 / 20
"""The same for each of ten gaps: five strengths, and one before each."""
_BETWEEN = 2000
"""Number of the stream of strengths between those of the table."""


@dataclasses.dataclass
class End:
    """How far a course leads."""

    limit: float
    """The last strength that is surely good."""
    flown: list[tuple[float, bool]]
    """Strengths, and whether each is surely good."""
    failed: float | None = None
    """The first strength of the course that is not."""


def walk(axis: Axis, sign: int, seed: int, is_good: Callable[[float, float], bool]) -> End:
    """Find one end of a range: the same strengths for everybody who has the same answers.

    Args:
        axis: Of which.
        sign: On which side of no difference, along the axis's scale: -1 or 1.
        seed: Of the strengths that are drawn between those of the table.
        is_good: Whether a strength is surely good, and the part of the axis's error that the answer
            may take.
    """
    end = End(axis.neutral, [])

    def at(strength: float, part: float) -> bool:
        good = is_good(strength, part)
        end.flown.append((strength, good))
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


class Prober:
    """Says at which strengths a policy is surely good."""

    def __init__(
        self,
        bed: PairedEvaluator,
        oracle: Episodes,
        good_share: float,
        possible_share: float = 0.9,
        plain_part: float = WALKING,
    ) -> None:
        """Takes what good is measured by.

        Args:
            bed: Where to fly.
            oracle: Of the task's oracle where nothing is different: what is hard for it, too, is no
                excuse.
            good_share: See `Rule`.
            possible_share: See `Suite`.
            plain_part: Of the axis's error, that the episodes without a difference may take.
        """
        task = oracle.task
        self._bed, self._oracle, self._possible = bed, oracle, possible_share
        self._rule = Rule(good_share=good_share, strata=task.strata, luck=task.luck)
        self._luck: dict[Any, dict[str, Episodes]] = {}
        self.plain = self.probe(Condition(), plain_part)

    def rule_at(self, part: float) -> Rule:
        """The rule with so much of an axis's error."""
        return dataclasses.replace(self._rule, error_rate=part * self._rule.error_rate)

    def probe(self, condition: Condition, part: float) -> dict[str, Any]:
        """Whether it is surely good under a condition.

        That is: the verdict is good, certainly, and it is surely better than luck, so that who
        looks at nothing is never called good, however easy a condition makes the task. Episodes
        that depend on rounding count as failures for "good", and as successes for "bad".

        Args:
            condition: Which.
            part: Of the axis's error, that this may take.

        Returns:
            "good" and "bad", surely: neither where too few were flown; "success", a share; "worst":
            the side on which it collects least, with "share". Of a task that can't be so:
            "refused", why.
        """
        try:
            key = self._bed.settings(condition)
        except InputError as error:
            return {"good": False, "bad": True, "refused": str(error)}
        flown, is_fragile = self._fly(condition)
        if key not in self._luck:  # who sees nothing minds neither look nor camera
            self._luck[key] = self._bed.fly_blindly(condition)
        rule = self.rule_at(part)
        baselines = {**self._luck[key], "oracle": self._oracle}
        found = dict(
            zip(rule.quantities, _measure(flown, baselines, rule, is_fragile), strict=True)
        )
        return {
            "good": is_surely_good(found, rule),
            "bad": Kind.GOOD not in _kinds(found, rule),
            "refused": None,
            "success": float(flown.success.mean()),
            "worst": _worst(found, rule),
        }

    def _fly(self, condition: Condition) -> tuple[Episodes, Tensor]:
        """The policy's episodes, and which of them depend on rounding. Shape: (n,), bool."""
        subject, count = self._bed.subject, self._bed.episodes
        eyes = PolicyAgent(subject.network, subject.transforms, count, examines_rounding=True)
        return self._bed.fly(condition, eyes=eyes).episodes, eyes.is_fragile

    def search(self, axis: Axis) -> dict[str, Any]:
        """The widest range of an axis.

        Returns:
            "low", "high": its least and greatest value, None for an infinite one; "positions": its
            ends on the axis's scale, the lower one first, which is that of "high" where less is
            stronger, as of metres of sight, None if not even no difference is good; "low_open",
            "high_open": whether the strongest that was tried there is still good, None where none
            was; "failed": where courses end, that of the lower values first: "end", "value", what
            was found there, how often who knows where all is that the camera shows succeeds there
            ("oracle", None where nobody does), and whether that shows it to be "impossible";
            "flown": all that was tried, from the lowest position on: "value", "position", and
            whether it is "good".
        """
        if not self.plain["good"]:
            nothing = {"low": None, "high": None, "positions": None, "failed": [], "flown": []}
            return {**nothing, "low_open": None, "high_open": None}
        probed: dict[float, dict[str, Any]] = {}

        def is_good(strength: float, part: float) -> bool:
            condition = axis.make(strength, self._bed.subject)
            probed[strength] = self.probe(condition, part)
            return probed[strength]["good"]

        signs = axis.signs.items()
        ends = {name: walk(axis, sign, self._bed.seed, is_good) for name, sign in signs}
        failed = [
            {"end": name, "value": self._value(axis, end.failed)}
            | self._explain(axis, end.failed, probed[end.failed])
            for name, end in ends.items()
            if end.failed is not None
        ]
        flown = sorted(
            (axis.position(strength), self._value(axis, strength), good)
            for end in ends.values()
            for strength, good in end.flown
        )
        return {
            **{name: self._value(axis, end.limit) for name, end in ends.items()},
            "positions": sorted(axis.position(end.limit) for end in ends.values()),
            **{
                f"{name}_open": end.failed is None if end.flown else None
                for name, end in ends.items()
            },
            "failed": failed,
            "flown": [{"position": p, "value": v, "good": good} for p, v, good in flown],
        }

    def _explain(self, axis: Axis, strength: float, found: dict[str, Any]) -> dict[str, Any]:
        """Whether it is the policy that fails, or whether nobody could do it."""
        if found["refused"] is not None or not has_oracle(self._oracle.task):
            return {**found, "oracle": None, "impossible": False}
        condition = axis.make(strength, self._bed.subject)
        success = self._bed.fly(condition, eyes=OracleAgent()).episodes.success
        seen = proportion(int(success.sum()), len(success))
        return {**found, "oracle": seen, "impossible": seen["upper95"] < self._possible}

    def _value(self, axis: Axis, strength: float) -> float | None:
        return finite(axis.value(strength, self._bed.subject))


def _measure(
    flown: Episodes, baselines: Mapping[str, Episodes], rule: Rule, is_fragile: Tensor
) -> tuple[Quantity, ...]:
    """The rule's quantities, whatever the ends of the fragile episodes."""
    unknown = Outcomes(None, torch.empty(0, dtype=torch.int64), is_fragile)
    return widen(measure(flown, baselines, rule), flown, baselines, rule, unknown)


def is_surely_good(found: Mapping[str, Quantity], rule: Rule) -> bool:
    """Whether the verdict is good wherever the quantities lie, and luck is surely surpassed.

    Args:
        found: The rule's quantities by name, in its order.
        rule: With the probability of being wrong.
    """
    sees = all(found[f"above {name}"].levels[0] > 0 for name in rule.luck)
    return sees and _kinds(found, rule) == {Kind.GOOD}


def _kinds(found: Mapping[str, Quantity], rule: Rule) -> frozenset[Kind]:
    """All that it may be."""
    box = tuple(quantity.levels for quantity in found.values())
    return kinds_within(box, len(rule.strata))


def _worst(found: Mapping[str, Quantity], rule: Rule) -> dict[str, Any] | None:
    """The stratum of which the least share is reached."""
    shares = {s: found[f"collected {s}"].value for s in rule.strata}
    known = {stratum: share for stratum, share in shares.items() if share is not None}
    if not known:
        return None
    side = min(known, key=lambda stratum: known[stratum])
    return {"side": side, "share": known[side]}


def _course(axis: Axis, side: list[float], seed: int) -> Iterator[float]:
    """The strengths of one side, from the weakest on, and one before each."""
    generator = torch_generator(seed, Stream.SHIFTS, number=_BETWEEN)
    shares = torch.rand(len(axis.strengths), generator=generator, dtype=torch.float64)
    before = axis.neutral
    for strength, share in zip(side, shares.tolist(), strict=False):
        yield from _inside(axis, before, strength, [share])
        yield strength
        before = strength


def _side(axis: Axis, sign: int) -> list[float]:
    """The strengths of the table on one side of no difference, from the weakest on."""
    there = [strength for strength in axis.strengths if sign * axis.position(strength) > 0]
    return sorted(there, key=lambda strength: abs(axis.position(strength)))


def _inside(axis: Axis, near: float, far: float, shares: list[float]) -> list[float]:
    """Strengths between two, from the nearer on, each once."""
    there = (axis.between(near, far, share) for share in shares)
    return list(dict.fromkeys(strength for strength in there if strength is not None))
