"""Intervals for means over frames that come in episodes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

DRAWS = 2000


def mean_interval(values: NDArray, episode: NDArray, seed: int = 0) -> dict[str, Any]:
    """The mean over frames with a 95% bootstrap interval that resamples whole episodes.

    Frames of one episode are alike, so that an interval that took them for independent would be
    far too narrow.

    Args:
        values: One a frame; NaN where a frame says nothing. Shape: (T,).
        episode: The episode of each frame. Shape: (T,).
        seed: Of the resampling.

    Returns:
        "mean", "lower95", "upper95" (None where there is no frame), "frames" and "episodes".
    """
    told = np.isfinite(values)
    if not told.any():
        return {"mean": None, "lower95": None, "upper95": None, "frames": 0, "episodes": 0}
    _, cluster = np.unique(episode[told], return_inverse=True)
    totals = np.bincount(cluster, weights=values[told].astype(np.float64))
    counts = np.bincount(cluster).astype(np.float64)
    draws = np.random.default_rng(seed).integers(0, len(totals), (DRAWS, len(totals)))
    means = totals[draws].sum(1) / counts[draws].sum(1)
    return {
        "mean": float(totals.sum() / counts.sum()),
        "lower95": float(np.quantile(means, 0.025)),
        "upper95": float(np.quantile(means, 0.975)),
        "frames": int(told.sum()),
        "episodes": len(totals),
    }
