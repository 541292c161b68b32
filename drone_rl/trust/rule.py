"""The rule of the verdict: quantities, thresholds, and the kind in every corner of a box.

The level of a quantity is the number of its thresholds that it exceeds; the levels decide the kind.
In all but the allowed fraction of cases, all intervals hold at once. The verdict is certain if all
levels within the intervals lead to the same kind.
"""

import enum
import functools
import itertools
from collections.abc import Iterable, Sequence
from typing import Annotated, Self

import pydantic

from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import NO_KIND, ONE_SIDED, POOR, TRIVIAL
from drone_rl.utils.models import Model, Stored

Fraction = Annotated[float, pydantic.Field(gt=0.0, lt=1.0)]


class VerdictKind(enum.StrEnum):
    """Kind of a policy."""

    GOOD = "good"
    TRIVIAL = "good, but trivial"
    """As good as required, and so is a baseline that ignores the observations."""
    POOR = "poor"
    ONE_SIDED_LEFT = "one-sided (left)"
    ONE_SIDED_RIGHT = "one-sided (right)"
    NONE = "none of these"

    @property
    def exit_code(self) -> int:
        """Exit code if it is certain, see `drone_rl.utils.exit_codes`."""
        codes = {
            VerdictKind.GOOD: 0,
            VerdictKind.POOR: POOR,
            VerdictKind.NONE: NO_KIND,
            VerdictKind.TRIVIAL: TRIVIAL,
        }
        return codes.get(self, ONE_SIDED)

    @property
    def family(self) -> str:
        """One of `KINDS`."""
        return "one-sided" if self.exit_code == ONE_SIDED else self.value


KINDS = ("good", "good, but trivial", "one-sided", "poor", "none of these")
"""Families of kinds, best first, without the side."""


SIDES = ("left", "ahead", "right")
"""Strata of cube collection, as in `sim.tasks.common`, which imports torch."""
BLIND_BASELINES = ("random", "forward", "left", "right")
"""Random and constant baselines of cube collection."""
TOLERANCE = 1e-9
"""Rounding of a mean: a value that exceeds a threshold by less counts as equal to it."""
USABLE = 0.5
"""Success rate that an oracle must exceed; without such an oracle, thresholds are absolute."""


class Rule(Model):
    """Thresholds."""

    good_share: Fraction = 0.9
    """Fraction of the oracle's success rate that a good policy exceeds; without an oracle that
    succeeds in more than `USABLE` of the episodes, the success rate itself."""
    side_share: Fraction = 0.7
    """Fraction of goals that a good policy exceeds on each side, a one-sided one on its side."""
    other_share: Fraction = 0.3
    """Fraction of goals that a one-sided policy does not exceed on the other side."""
    offered_share: Fraction = 0.05
    """Fraction of episodes that must offer a goal on a side for the side to count."""
    poor_margin: Fraction = 1 / 6
    """Fraction of the way from the best random or constant baseline to the oracle up to which a
    policy is poor."""
    error_rate: Fraction = 0.05
    """Largest fraction of cases in which the verdict is certain and wrong."""
    strata: tuple[str, ...] = SIDES
    """Of the task, from left to right; one-sided policies differ between first and last."""
    blind_baselines: tuple[str, ...] = BLIND_BASELINES
    """Random and constant baselines of the task."""

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("strata", "blind_baselines"):
            if not getattr(self, name):
                raise InputError(f"a task without {name} can't be judged; name some in the task")
        if "all" in self.strata:
            raise InputError('a stratum can\'t be called "all"; give it another name in the task')
        if self.other_share > self.side_share:
            raise InputError(
                f"other_share={self.other_share} must not exceed side_share={self.side_share}"
            )
        return self

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the rule's quantities, in order."""
        return (
            "success",
            *(f"offered {stratum}" for stratum in self.strata),
            *(f"collected {stratum}" for stratum in self.strata),
            *(f"above {name}" for name in self.blind_baselines),
            *(f"unsolved by {name}" for name in self.blind_baselines),
        )

    @property
    def thresholds(self) -> tuple[tuple[float, ...], ...]:
        """Thresholds of each of `quantities`, in rising order."""
        offered, shares = (self.offered_share,), (self.other_share, self.side_share)
        count, blind = len(self.strata), 2 * len(self.blind_baselines)
        return ((0.0,), *[offered] * count, *[shares] * count, *[(0.0,)] * blind)

    @property
    def ranges(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest value of each of `quantities` in an episode."""
        shares, good = [(0.0, 1.0)] * (2 * len(self.strata)), self.good_share
        blind = len(self.blind_baselines)
        return ((-good, 1.0), *shares, *[(-1.0, 1.0)] * blind, *[(-1.0, good)] * blind)

    @property
    def confidence(self) -> float:
        """Confidence of each quantity's interval, so that all hold at once (Bonferroni)."""
        return 1.0 - self.error_rate / len(self.quantities)

    @property
    def text(self) -> str:
        """The rule as text, for all strata and baselines."""
        return f"""\
good: the share of episodes that succeed is more than \
{100 * self.good_share:g}% of the oracle's, and so are more than {100 * self.side_share:g}% of the \
goals of each stratum (such as left, ahead and right), wherever more than \
{100 * self.offered_share:g}% of episodes offer one. good, but trivial: the same, but random \
actions or one action always succeed in at least {100 * self.good_share:g}% of the episodes that \
the policy or the oracle solves, too. one-sided: more than {100 * self.side_share:g}% of the goals \
of the first or last stratum and no more than {100 * self.other_share:g}% of the other one, both \
offered. poor: neither, and no farther than {self.poor_margin:.0%} of the way from luck to the \
oracle, in goals; luck is the best of random actions and of each action always, in the same \
environments. none of these: anything else. Without an oracle that succeeds in more than \
{USABLE:.0%} of episodes, thresholds are absolute: success in every episode takes its place. \
Every episode counts once: a share is a mean over episodes. The verdict is certain if the kind is \
the same wherever the quantities lie within their intervals. The procedure that gives them errs in \
at most {100 * self.error_rate:g}% of cases, that is, an interval misses its quantity, whatever \
depends on what within an episode."""


class Quantity(Stored):
    """One number of the rule, with its interval."""

    value: float | None
    """None if there are no data, as for goals that were never offered."""
    lower: float
    upper: float
    thresholds: tuple[float, ...]

    @property
    def level(self) -> int:
        """Number of thresholds that the value exceeds."""
        return 0 if self.value is None else level(self.value - TOLERANCE, self.thresholds)

    @property
    def levels(self) -> tuple[int, int]:
        """Least and greatest level within the interval."""
        lower = level(self.lower - TOLERANCE, self.thresholds)
        return lower, level(self.upper + TOLERANCE, self.thresholds)


def level(value: float, thresholds: Iterable[float]) -> int:
    """Return the number of thresholds that a value exceeds."""
    return sum(value > threshold for threshold in thresholds)


def decide(levels: Sequence[int], num_strata: int = len(SIDES)) -> VerdictKind:
    """Return the kind.

    Args:
        levels: Of each of `Rule.quantities`.
        num_strata: Number of strata among them.
    """
    success, *rest = levels
    offered, shares = rest[:num_strata], rest[num_strata : 2 * num_strata]
    blind = rest[2 * num_strata :]
    above, unsolved = blind[: len(blind) // 2], blind[len(blind) // 2 :]
    if success and all(
        share == 2 or not there for there, share in zip(offered, shares, strict=True)
    ):
        return VerdictKind.GOOD if all(unsolved) else VerdictKind.TRIVIAL
    if offered[0] and offered[-1]:
        if (shares[0], shares[-1]) == (0, 2):
            return VerdictKind.ONE_SIDED_RIGHT
        if (shares[0], shares[-1]) == (2, 0):
            return VerdictKind.ONE_SIDED_LEFT
    return VerdictKind.NONE if all(above) else VerdictKind.POOR


@functools.lru_cache(maxsize=4096)
def kinds_within(
    box: tuple[tuple[int, int], ...], num_strata: int = len(SIDES)
) -> frozenset[VerdictKind]:
    """Return the kinds of all cells of a box.

    Args:
        box: Least and greatest level of each of `Rule.quantities`.
        num_strata: Number of strata among them.
    """
    blind = box[1 + 2 * num_strata :]
    halves = blind[: len(blind) // 2], blind[len(blind) // 2 :]
    # `decide` uses only whether all levels of a half are above 0, so the least one is enough
    least = [
        (min(low for low, _ in half), min(high for _, high in half)) for half in halves if half
    ]
    pieces = [range(low, high + 1) for low, high in (*box[: 1 + 2 * num_strata], *least)]
    return frozenset(decide(cell, num_strata) for cell in itertools.product(*pieces))
