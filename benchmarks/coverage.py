"""Exact coverage of the reported confidence intervals, by enumeration.

An interval is computed from one value for each episode. So a kind of dependence between cubes or
frames of an episode is a distribution of this value. With few episodes and few values all outcomes
can be enumerated with their probabilities. The coverage is exact; nothing is sampled.
"""

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom, multinomial

from benchmarks.benchmark import Setup
from benchmarks.simulated_policies import bench_false_certain
from drone_rl.utils.intervals import mean_bounds, median_bounds, proportion

NEGLIGIBLE = 1e-10
"""Outcomes with a lower probability are skipped and count as not covered."""
SIZES = {2: (1, 2, 5, 13, 30, 100, 400), 3: (1, 2, 5, 13, 30), 4: (1, 2, 5, 13), 5: (1, 2, 5, 8)}
"""Numbers of episodes by number of values; intervals are reported from 1 episode on."""
MEDIAN_SIZES = (6, 7, 13, 30)
"""Numbers of values for medians, which are reported from 6 values on."""


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Distribution of the value of an episode."""

    values: tuple[float, ...]
    probabilities: tuple[float, ...]
    low: float = 0.0
    high: float = 1.0

    @property
    def mean(self) -> float:
        """The true mean, which an interval should contain."""
        return float(np.dot(self.values, self.probabilities))


def _thirds(*probabilities: float) -> Outcome:
    """Return a distribution of the fraction of three cubes: none, one, two, all."""
    return Outcome((0.0, 1 / 3, 2 / 3, 1.0), probabilities)


def _independent(share: float) -> Outcome:
    return _thirds(*binom.pmf(range(4), 3, share))


OUTCOMES: Mapping[str, Outcome] = {
    "independent cubes": _independent(0.9),
    "independent cubes, poor": _independent(0.3),
    "all or nothing, 9 of 10": Outcome((0.0, 1.0), (0.1, 0.9)),
    "all or nothing, evenly": Outcome((0.0, 1.0), (0.5, 0.5)),
    "a rare disaster": Outcome((0.0, 1.0), (0.03, 0.97)),
    "a very rare disaster": Outcome((0.0, 1.0), (0.002, 0.998)),
    "the first miss ends it": _thirds(0.1, 0.09, 0.081, 0.729),
    "cubes grow harder": _thirds(0.02, 0.18, 0.4, 0.4),
    "easy and hard worlds": _thirds(0.25, 0.05, 0.0, 0.7),
    "two of three, always but once in 20": _thirds(0.0, 0.05, 0.95, 0.0),
    "a miss alerts it": _thirds(0.0, 0.0, 0.3, 0.7),
    "one or two cubes on a side": Outcome((0.0, 0.5, 1.0), (0.15, 0.1, 0.75)),
    "paired successes": Outcome((-0.9, 0.1), (0.1, 0.9), low=-0.9),
    "paired successes, oracle fallible": Outcome((-0.9, 0.0, 0.1), (0.08, 0.02, 0.9), low=-0.9),
    "paired shares": Outcome((-1 / 3, 0.0, 1 / 3, 2 / 3, 1.0), (0.1, 0.3, 0.3, 0.2, 0.1), low=-1.0),
    "paired shares, mostly equal": Outcome((-1.0, 0.0, 1.0), (0.02, 0.93, 0.05), low=-1.0),
    "frames, stuck episodes": Outcome((0.02, 0.5, 0.98), (0.6, 0.05, 0.35)),
    "frames, one in 30 episodes differs": Outcome((0.01, 0.9), (29 / 30, 1 / 30)),
    "frames, all alike": Outcome((0.4, 0.45, 0.5, 0.55), (0.2, 0.3, 0.3, 0.2)),
    "frames, signed scores": Outcome((-0.2, 0.05, 0.9), (0.5, 0.4, 0.1), low=-1.0),
}
"""Distributions of an episode's value for kinds of dependence within episodes."""
TIMES: Mapping[str, Outcome] = {
    "times, a third never": Outcome((1.0, 2.0, np.inf), (0.3, 0.37, 0.33)),
    "times, nearly half never": Outcome((1.0, 2.0, np.inf), (0.1, 0.45, 0.45)),
    "times, two groups": Outcome((1.0, 9.0), (0.55, 0.45)),
}
"""Distributions of times, for medians; infinite if the event never happens."""


def bench_coverage(setup: Setup) -> dict[str, Any]:
    """Compute the coverage of all kinds of intervals, and the rate of certain but wrong verdicts.

    Returns:
        "interval_coverage_min", the lowest coverage; "interval_coverage_least", its row;
        "interval_coverage", all rows; and the figures of `bench_false_certain`.
    """
    rows = [*_proportions(setup.quick), *_means(setup.quick), *_medians(setup.quick)]
    least = min(rows, key=lambda row: row["coverage"])
    return {
        "interval_coverage_min": least["coverage"],
        "interval_coverage_least": least,
        "interval_coverage": rows,
        **bench_false_certain(setup.quick),
    }


def coverage(outcome: Outcome, episodes: int, holds: Callable[[NDArray], bool]) -> float:
    """Return the exact probability that an interval contains the true value.

    Args:
        outcome: Distribution of the value of an episode.
        episodes: Number of episodes.
        holds: Return whether the interval of some values contains it. Shape: (episodes,).
    """
    counts = np.array(list(_compositions(episodes, len(outcome.values))))
    probabilities = multinomial.pmf(counts, episodes, outcome.probabilities)
    likely = probabilities > NEGLIGIBLE
    pairs = zip(counts[likely], probabilities[likely], strict=True)
    return float(sum(p for row, p in pairs if holds(np.repeat(outcome.values, row))))


def _means(quick: bool) -> Iterator[dict[str, Any]]:
    for name, outcome in OUTCOMES.items():

        def holds(values: NDArray, of: Outcome = outcome) -> bool:
            interval = mean_bounds(values, of.low, of.high)
            return interval.lower95 - 1e-12 <= of.mean <= interval.upper95 + 1e-12

        for episodes in SIZES[len(outcome.values)][: 3 if quick else None]:
            yield _row("mean", name, episodes, coverage(outcome, episodes, holds))


def _proportions(quick: bool) -> Iterator[dict[str, Any]]:
    """Return the minimum over all true rates, which is next to the bounds of the intervals."""
    for episodes in SIZES[2][: 3 if quick else None]:
        intervals = [proportion(k, episodes) for k in range(episodes + 1)]
        low, high = np.array([(one.lower95, one.upper95) for one in intervals]).T
        ends = np.concatenate([low, high])
        truths = np.concatenate([ends - 1e-9, ends + 1e-9]).clip(0.0, 1.0)[:, None]
        covered = (low <= truths) & (truths <= high)
        least = (binom.pmf(np.arange(episodes + 1), episodes, truths) * covered).sum(1).min()
        yield _row("share", "any share of episodes", episodes, float(least))


def _medians(quick: bool) -> Iterator[dict[str, Any]]:
    for episodes in MEDIAN_SIZES[: 2 if quick else None]:
        ranks = median_bounds(range(1, episodes + 1))
        if ranks is None:
            raise ValueError(f"median_bounds returns no interval of {episodes} values")
        lower, upper = ranks  # covered if the number of values below the median is in between
        below = binom.cdf(upper - 1, episodes, 0.5) - binom.cdf(lower - 1, episodes, 0.5)
        yield _row("median", "any continuous distribution", episodes, float(below))
        for name, outcome in TIMES.items():
            middle = _median(outcome)

            def holds(values: NDArray, truth: float = middle) -> bool:
                bounds = median_bounds(values)
                return bounds is not None and bounds[0] <= truth <= bounds[1]

            yield _row("median", name, episodes, coverage(outcome, episodes, holds))


def _median(outcome: Outcome) -> float:
    reached = np.cumsum(outcome.probabilities) >= 0.5
    return outcome.values[int(np.argmax(reached))]


def _compositions(total: int, parts: int) -> Iterator[tuple[int, ...]]:
    """Yield all tuples of `parts` non-negative integers with a sum of `total`."""
    for bars in itertools.combinations(range(total + parts - 1), parts - 1):
        edges = (-1, *bars, total + parts - 1)
        yield tuple(b - a - 1 for a, b in itertools.pairwise(edges))


def _row(interval: str, kind: str, episodes: int, covered: float) -> dict[str, Any]:
    return {"interval": interval, "kind": kind, "episodes": episodes, "coverage": covered}
