"""New rollouts at a sample of the strengths at which a file says that a policy is good.

What a file says was counted can be invented with care, so that no check of its numbers is enough.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import closing
from typing import Any

import numpy as np

from drone_rl.config.commands import JudgeSettings, ShiftSettings
from drone_rl.evaluation.rule import Rule
from drone_rl.policies.base_policy import Pilot
from drone_rl.robustness.axes import find_axes
from drone_rl.robustness.axis import Axis
from drone_rl.robustness.condition import Condition
from drone_rl.robustness.domain import Prober
from drone_rl.robustness.domain_text import contradicted, needed_range
from drone_rl.robustness.flying import Airfield, Subject
from drone_rl.robustness.needs import Need
from drone_rl.robustness.oracle import OracleEyes
from drone_rl.utils.intervals import mean_bounds
from drone_rl.utils.seeding import RootSeed

RANDOM = 2
"""Strengths that are drawn at random within each range, besides its ends."""


@dataclasses.dataclass(frozen=True)
class Reflown:
    """New rollouts under required conditions, held against what a file says of these."""

    episodes: int
    """At each strength."""
    seed: int
    """Of the episodes and of the random strengths."""
    seed_is_fixed: bool
    """Whether it was chosen beforehand, so that a policy could be fitted to it."""
    strengths: Mapping[str, tuple[float, ...]]
    """By axis, the values that were flown."""
    contradictions: tuple[str, ...]
    """What speaks against the file, one line each."""
    fewest: int
    """Successes at a strength; with fewer it would have been contradicted."""

    @property
    def count(self) -> int:
        """Strengths of all axes."""
        return sum(map(len, self.strengths.values()))

    def __str__(self) -> str:
        """By how many episodes, and what these rule out."""
        fitted = ", to which a policy could have been fitted" if self.seed_is_fixed else ""
        kind = "fixed" if self.seed_is_fixed else "fresh"
        return (
            f"re-flown by {self.episodes:,} episodes at each of {self.count} strengths, ends of "
            f"the ranges and random ones ({kind} seed {self.seed}{fitted}); fewer than "
            f"{self.fewest:,} successes at one would have contradicted the file"
        )


def refly(
    policy: Pilot,
    needs: Mapping[str, Need],
    numbers: Mapping[str, Any],
    settings: JudgeSettings,
    seed: RootSeed,
) -> Reflown:
    """Fly new episodes at the ends of the required ranges and at random strengths within them.

    Args:
        policy: Which, in the task that counts.
        needs: By axis, see `drone_rl.robustness.needs.read_needs`.
        numbers: As in `shifts.json`, with the axes.
        settings: `domain_flights`, `good_share`, device and renderer count.
        seed: Root of the random streams of the sample and of its environments.
    """
    from drone_rl.robustness.shifts import make_subject  # slow to import: it draws charts

    how = ShiftSettings(device=settings.device, renderer=settings.renderer)
    subject, rng = make_subject(policy, how), np.random.default_rng(seed.value)
    tried = {
        axis: [*_strengths(axis, subject, needs[axis.name], numbers, rng)]
        for axis in find_axes(needs, subject)
    }
    count = sum(map(len, tried.values())) + 1
    with closing(Airfield(subject, settings.domain_flights, seed.value)) as bed:
        oracle = bed.fly(Condition(), eyes=OracleEyes(looks=False)).episodes
        prober = Prober(bed, oracle, settings.good_share, plain_part=1 / count)
        found = [_contradiction(None, prober.plain, 0.0, "")]
        for axis, strengths in tried.items():
            for strength in strengths:
                probed = prober.probe(axis.make(strength, subject), 1 / count)
                value = axis.value(strength, subject)
                found.append(_contradiction(axis.name, probed, value, axis.unit))
    return Reflown(
        episodes=settings.domain_flights,
        seed=seed.value,
        seed_is_fixed=seed.is_fixed,
        strengths={
            axis.name: tuple(axis.value(strength, subject) for strength in strengths)
            for axis, strengths in tried.items()
        },
        contradictions=tuple(line for line in found if line is not None),
        fewest=_fewest(settings.domain_flights, prober.rule_at(1 / count)),
    )


def _strengths(
    axis: Axis,
    subject: Subject,
    need: Need,
    numbers: Mapping[str, Any],
    rng: np.random.Generator,
) -> Iterator[float]:
    """The ends that differ from no difference, and random strengths between them, each once."""
    low, high = needed_range(numbers["axes"][axis.name], need)
    ends = sorted(axis.position(axis.strength(value, subject)) for value in (low, high))
    drawn = rng.uniform(ends[0], ends[1], RANDOM) if ends[0] < ends[1] else []
    seen: set[float] = set()
    for position in (*ends, *(float(one) for one in drawn)):
        strength = axis.at(position)
        strength = float(round(strength)) if axis.whole else strength
        if abs(axis.position(strength)) > 1e-12 and strength not in seen:
            seen.add(strength)
            yield strength


def _contradiction(
    name: str | None, probed: Mapping[str, Any], value: float, unit: str
) -> str | None:
    return contradicted(name, value, unit, probed) if probed["bad"] else None


def _fewest(episodes: int, rule: Rule) -> int:
    """The fewest successes that do not contradict, next to an oracle that always succeeds."""
    least, most = 0, episodes
    while least < most:
        middle = (least + most) // 2
        values = np.repeat([1.0, 0.0], [middle, episodes - middle]) - rule.good_share
        upper = mean_bounds(values, -rule.good_share, 1.0, rule.confidence)["upper95"]
        least, most = (least, middle) if upper > 0 else (middle + 1, most)
    return least
