"""Means over frames that come in episodes, with intervals that count the episodes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.intervals import mean_bounds


def episode_means(values: NDArray, episode: NDArray) -> NDArray:
    """The mean of each episode over its frames that say something.

    Args:
        values: One a frame; NaN where a frame says nothing. Shape: (T,).
        episode: The episode of each frame. Shape: (T,).

    Returns:
        Shape: (E,), the episodes in which some frame does.
    """
    known = np.isfinite(values)
    _, number = np.unique(episode[known], return_inverse=True)
    totals = np.bincount(number, weights=values[known].astype(np.float64))
    return totals / np.bincount(number)


def mean_interval(
    values: NDArray, episode: NDArray, low: float = 0.0, high: float = 1.0
) -> dict[str, Any]:
    """The mean over episodes of their means, with a 95% interval that counts episodes.

    Frames of one episode are alike, so that an interval that took them for independent would be
    far too narrow. Episodes are independent, and that is all that this one assumes.

    Args:
        values: One a frame, from `low` to `high`; NaN where a frame says nothing. Shape: (T,).
        episode: The episode of each frame. Shape: (T,).
        low: Least possible value.
        high: Greatest possible value.

    Returns:
        "mean", "lower95", "upper95" (None where there is no frame), "frames" and "episodes".
    """
    means = episode_means(values, episode)
    bounds = mean_bounds(means, low, high)
    known = bounds["mean"] is not None
    return {
        "mean": bounds["mean"],
        "lower95": bounds["lower95"] if known else None,
        "upper95": bounds["upper95"] if known else None,
        "frames": int(np.isfinite(values).sum()),
        "episodes": len(means),
    }
