"""The operating domain: how far each axis may go while the policy surely stays good.

From no difference outwards every strength of the table is tried until one is not surely good; then
the range between that one and the last good one is halved a few times. So every limit has been
flown at, and so have all strengths of the table within it: that nothing is worse between them is
taken for granted, that nothing nearer is worse is not.
"""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from drone_rl.conditions.axis import Axis
from drone_rl.conditions.condition import Condition
from drone_rl.conditions.flying import Airfield
from drone_rl.conditions.suite import finite
from drone_rl.evaluation import Episodes
from drone_rl.utils.errors import InputError
from drone_rl.verdicts.judge import measure
from drone_rl.verdicts.kinds import Kind
from drone_rl.verdicts.rule import Quantity, Rule, kinds_within

HALVINGS = 4
TESTS = 5 + 2 * HALVINGS
"""Strengths of an axis that are tried at most, all of which count when its limits are certain."""


class Prober:
    """Says at which strengths a policy is surely good."""

    def __init__(self, bed: Airfield, oracle: Episodes, good_share: float) -> None:
        """Takes what good is measured by.

        Args:
            bed: Where to fly.
            oracle: Of the task's oracle where nothing is different: what is hard for it, too, is no
                excuse.
            good_share: See `Rule`.
        """
        task = oracle.task
        self._bed, self._oracle = bed, oracle
        rule = Rule(good_share=good_share, strata=task.strata, luck=task.luck)
        self._rule = dataclasses.replace(rule, error_rate=rule.error_rate / TESTS)
        self._luck: dict[Any, dict[str, Episodes]] = {}
        self.plain = self.probe(Condition())

    def probe(self, condition: Condition) -> dict[str, Any]:
        """Whether it is surely good under a condition.

        That is: the verdict is good, certainly, and it is surely better than luck, so that who
        looks at nothing is never called good, however easy a condition makes the task.

        Returns:
            "good" and "bad", surely: neither where too few were flown; "success", a share; "worst":
            the side on which it collects least, with "share". Of a task that can't be so:
            "refused", why.
        """
        try:
            key = self._bed.settings(condition)
        except InputError as error:
            return {"good": False, "bad": True, "refused": str(error)}
        flown = self._bed.fly(condition).episodes
        if key not in self._luck:  # who sees nothing minds neither look nor camera
            self._luck[key] = self._bed.fly_blindly(condition)
        baselines = {**self._luck[key], "oracle": self._oracle}
        found = dict(zip(self._rule.quantities, measure(flown, baselines, self._rule), strict=True))
        return {
            "good": is_surely_good(found, self._rule),
            "bad": Kind.GOOD not in _kinds(found, self._rule),
            "refused": None,
            "success": float(flown.success.mean()),
            "worst": _worst(found, self._rule),
        }

    def search(self, axis: Axis) -> dict[str, Any]:
        """The widest range of an axis.

        Returns:
            "low", "high": its ends, values of the axis, None for an infinite one; "positions": the
            same on the axis's scale, None if not even no difference is good; "low_open",
            "high_open": whether the strongest that was tried there is still good, None where none
            was; "failed": the first strengths of the table that are not surely good, with what was
            found there; "tests": how many strengths were flown.
        """
        sides = [
            sorted((s for s in axis.strengths if is_there(axis.position(s))), key=_away(axis))
            for is_there in (lambda p: p < 0, lambda p: p > 0)
        ]
        value = self._valued(axis)
        if not self.plain["good"]:
            nothing = {"low": None, "high": None, "positions": None, "failed": [], "tests": 0}
            return {**nothing, "low_open": None, "high_open": None}
        ends = [self._walk(axis, side) for side in sides]
        (low, low_failed, _), (high, high_failed, _) = ends
        failed = [
            {"value": value(strength), **found}
            for end in ends
            if end[1]
            for strength, found in [end[1]]
        ]
        return {
            "low": finite(value(low)),
            "high": finite(value(high)),
            "positions": [axis.position(low), axis.position(high)],
            "low_open": low_failed is None if sides[0] else None,
            "high_open": high_failed is None if sides[1] else None,
            "failed": failed,
            "tests": sum(end[2] for end in ends),
        }

    def _walk(
        self, axis: Axis, side: list[float]
    ) -> tuple[float, tuple[float, dict[str, Any]] | None, int]:
        """Finds one end.

        Returns:
            The last good strength; the first of the table that is not, with what was found there;
            and how many were tried.
        """
        good, failed, tests = axis.neutral, None, 0
        for strength in side:
            found, tests = self._at(axis, strength), tests + 1
            if not found["good"]:
                failed = (strength, found)
                break
            good = strength
        if failed is None:
            return good, None, tests
        far = failed[0]
        for _ in range(HALVINGS):
            middle = axis.between(good, far)
            if middle is None:
                break
            is_good, tests = self._at(axis, middle)["good"], tests + 1
            good, far = (middle, far) if is_good else (good, middle)
        return good, failed, tests

    def _at(self, axis: Axis, strength: float) -> dict[str, Any]:
        return self.probe(axis.make(strength, self._bed.subject))

    def _valued(self, axis: Axis) -> Callable[[float], float]:
        return lambda strength: axis.value(strength, self._bed.subject)


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


def _away(axis: Axis) -> Callable[[float], float]:
    return lambda strength: abs(axis.position(strength))
