"""An axis: one thing that can be different, in a unit, at five strengths fixed before any test."""

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

from drone_rl.robustness.condition import Condition
from drone_rl.robustness.flying import Subject

NUMBERS = (1, 2, 3, 4, 5)
"""Of the strengths, from the weakest on."""
TOGETHER = 3
"""The strength at which all axes are tried together."""


class Scale(NamedTuple):
    """Along which steps of an axis are compared: areas are taken and middles are found on it."""

    there: Callable[[float], float]
    back: Callable[[float], float]
    rises: bool = True
    """Whether greater values lie higher on it."""


LINEAR = Scale(float, float)
FACTORS = Scale(math.log, math.exp)
"""Half as much is as far as twice as much."""
INVERSE = Scale(lambda x: 1.0 / x, lambda x: math.inf if x == 0 else 1.0 / x, rises=False)
"""Infinitely much is none."""


def _as_it_is(strength: float, subject: Subject) -> float:
    return strength


@dataclasses.dataclass(frozen=True)
class Axis:
    """One thing that can be different."""

    name: str
    group: str
    """One of the ten kinds of shift."""
    unit: str
    """Of its values."""
    neutral: float
    """The strength of no difference."""
    strengths: tuple[float, float, float, float, float]
    """From the weakest on; those of an axis with two ends lie on both sides of the neutral one."""
    make: Callable[[float, Subject], Condition]
    """What a strength makes different for a policy.

    Raises:
        InputError: This task has no such thing.
    """
    value: Callable[[float, Subject], float] = _as_it_is
    """A strength in the axis's unit, where strengths are told by what the policy has itself."""
    own: Callable[[Subject], float] | None = None
    """What the neutral strength is for a policy, where that is not the same for all."""
    scale: Scale = LINEAR
    whole: bool = False
    """Whether there is nothing between whole numbers."""
    touched_by: tuple[str, ...] = ()
    """Settings of a training that make a difference of this kind, as in appearance.exposure: a
    training in which one of them is not as by default knows the axis."""

    def position(self, strength: float) -> float:
        """Where a strength lies on the axis's scale; 0 where nothing is different."""
        return self.scale.there(strength) - self.scale.there(self.neutral)

    @property
    def signs(self) -> dict[str, int]:
        """By end of a range of values, "low" and "high", on which side of the scale it lies."""
        return {"low": -1, "high": 1} if self.scale.rises else {"low": 1, "high": -1}

    def strength(self, value: float, subject: Subject) -> float:
        """The strength that has this value for a policy: the inverse of `value`, which is affine.

        Args:
            value: In the axis's unit.
            subject: The policy.
        """
        if not math.isfinite(value):
            return value
        zero, one = (self.value(strength, subject) for strength in (0.0, 1.0))
        strength = (value - zero) / (one - zero)
        return float(round(strength)) if self.whole else strength

    def between(self, low: float, high: float, share: float = 0.5) -> float | None:
        """The strength a share of the way from one to another; None where there is none."""
        there, back, _ = self.scale
        if not self.whole:
            return back(there(low) + share * (there(high) - there(low)))
        inside = round(abs(high - low)) - 1
        nearer = 1 + min(math.floor(share * inside), inside - 1)
        return math.copysign(nearer, high - low) + low if inside > 0 else None

    def at(self, position: float) -> float:
        """The strength that lies there on the axis's scale."""
        return self.scale.back(position + self.scale.there(self.neutral))
