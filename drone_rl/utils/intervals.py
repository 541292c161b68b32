"""Confidence intervals: exact ones of rates, and of bounded means for any distribution."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drone_rl.utils.models import Stored


class Share(Stored):
    """A rate with its exact (Clopper-Pearson) interval."""

    share: float | None
    """The rate; None without trials."""
    lower95: float
    """Lower end of the interval, 0 without trials; so named whatever the confidence is."""
    upper95: float
    """Upper end, 1 without trials."""
    successes: int
    """Trials that succeeded."""
    trials: int
    """All trials."""


class Mean(Stored):
    """A mean of bounded values with an interval that is valid for any distribution."""

    mean: float | None
    """The mean; None without values."""
    lower95: float
    """Lower end of the interval; without values, the least possible one."""
    upper95: float
    """Upper end; without values, the greatest possible one."""
    count: int
    """Number of values."""


def proportion(successes: int, trials: int, confidence: float = 0.95) -> Share:
    """Return a rate with its exact (Clopper-Pearson) interval."""
    from scipy.special import betaincinv  # slow to import, and trainings report no interval

    tail, failures = (1.0 - confidence) / 2, trials - successes
    lower = float(betaincinv(successes, failures + 1, tail)) if successes else 0.0
    upper = float(betaincinv(successes + 1, failures, 1.0 - tail)) if failures else 1.0
    share = successes / trials if trials else None
    return Share(share=share, lower95=lower, upper95=upper, successes=successes, trials=trials)


def rate_of(events: ArrayLike, confidence: float = 0.95) -> Share:
    """Return the rate of trials, (n,), that are 1 or true, with its exact interval."""
    trials = np.asarray(events)
    return proportion(int(trials.sum()), len(trials), confidence)


def mean_bounds(
    values: ArrayLike, low: float = 0.0, high: float = 1.0, confidence: float = 0.95
) -> Mean:
    """Return a mean of bounded values with an interval that is valid for any distribution.

    With one value for each episode the interval is valid for any dependence within episodes; it
    assumes no normality and no large sample. It contains the means that bets don't refute: the
    capital of fixed bets is a martingale if the mean is true, so that it grows tenfold with
    probability 0.1 at most (Ville; Waudby-Smith and Ramdas, 2024). A mixture of bets makes the
    order of the values irrelevant.

    Args:
        values: Independent and identically distributed, each from `low` to `high`; NaN is no value.
            Shape: (n,).
        low: Least possible value.
        high: Greatest possible value.
        confidence: Coverage of the interval.

    Raises:
        ValueError: A value is out of range.
    """
    z = (np.asarray(values, np.float64).ravel() - low) / (high - low)
    z = z[~np.isnan(z)]
    if (z < -1e-9).any() or (z > 1 + 1e-9).any():
        raise ValueError(f"values must lie from {low} to {high}")
    if len(z) == 0:
        return Mean(mean=None, lower95=low, upper95=high, count=0)
    z, tail = z.clip(0.0, 1.0), (1.0 - confidence) / 2
    lower, upper = _refuted_below(z, tail), 1.0 - _refuted_below(1.0 - z, tail)
    return Mean(
        mean=float(low + (high - low) * z.mean()),
        lower95=low + (high - low) * lower,
        upper95=low + (high - low) * upper,
        count=len(z),
    )


def _refuted_below(z: NDArray, tail: float) -> float:
    """Return the mean up to which every mean is refuted at level `tail`; values in [0, 1]."""
    distinct, counts = np.unique(z, return_counts=True)
    stakes, needed = _bets(len(z), tail)
    below, above = 0.0, 1.0
    for _ in range(60):
        middle = (below + above) / 2
        is_refuted = _wealth(distinct, counts, stakes, middle) >= needed
        below, above = (middle, above) if is_refuted else (below, middle)
    return below


def _bets(count: int, tail: float) -> tuple[NDArray, float]:
    """Return the fractions of the capital that are staked, and the log of the refuting wealth."""
    # from about 1 / sqrt(n) to everything
    stakes = 2.0 ** -np.arange(max(1, math.ceil(math.log2(math.sqrt(count)))) + 1)
    return stakes, math.log(len(stakes) / tail)


def _wealth(distinct: NDArray, counts: NDArray, stakes: NDArray, mean: float) -> float:
    """Return the log of what all bets against a mean have won together; values in [0, 1]."""
    with np.errstate(divide="ignore"):
        growth = np.log1p(stakes[:, None] * (distinct / mean - 1.0)) @ counts
    return float(np.logaddexp.reduce(growth))


def median_bounds(values: ArrayLike, confidence: float = 0.95) -> tuple[float, float] | None:
    """Return an interval of the median by order statistics, exact for any distribution.

    Its ends are two of the independent values (n,), which may be infinite (censored times). None of
    too few values (fewer than six at 95%).
    """
    from scipy.special import bdtr  # see `proportion`

    ordered = np.sort(np.asarray(values, np.float64).ravel())
    below = bdtr(np.arange(len(ordered) + 1), len(ordered), 0.5)  # P(at most so many lie below it)
    rank = int(np.searchsorted(below, (1.0 - confidence) / 2)) if len(ordered) else 0
    if rank < 1:
        return None
    return float(ordered[rank - 1]), float(ordered[-rank])


def episode_means(values: NDArray, episode: NDArray) -> NDArray:
    """Return the mean of each episode over its frames with values; NaN stands for none.

    Shapes: (T,), and the episode of each frame, (T,), to (E,), one for each episode with values.
    """
    has_value = np.isfinite(values)
    _, number = np.unique(episode[has_value], return_inverse=True)
    totals = np.bincount(number, weights=values[has_value].astype(np.float64))
    return totals / np.bincount(number)


def mean_interval(values: NDArray, episode: NDArray, low: float = 0.0, high: float = 1.0) -> Mean:
    """Return the mean over episodes of their means, with a 95% interval that counts episodes.

    Frames of one episode are alike, so that an interval for independent frames would be too narrow.
    `values` and `episode` are as for `episode_means`, from `low` to `high`.
    """
    return mean_bounds(episode_means(values, episode), low, high)
