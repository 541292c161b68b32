"""Learning curves of several runs as one: pure functions of arrays."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def interquartile_mean(values: Array, axis: int = 0) -> Array:
    """Mean of the middle half, which outliers don't move; a value on the edge counts in part.

    Args:
        values: Any number of values, 1 or more, along `axis`.
        axis: Is averaged over.
    """
    ordered = np.sort(np.moveaxis(np.asarray(values, float), axis, 0), axis=0)
    n = len(ordered)
    edges = np.arange(n + 1) / n
    weights = np.clip(np.minimum(edges[1:], 0.75) - np.maximum(edges[:-1], 0.25), 0.0, None)
    return np.tensordot(weights / weights.sum(), ordered, axes=1)


def bootstrap_band(
    values: Array, *, resamples: int = 1000, confidence: float = 0.95, seed: int = 0
) -> tuple[Array, Array]:
    """Percentile bootstrap of the interquartile mean over runs.

    Args:
        values: One row a run. Shape: (num_runs, num_points).
        resamples: Draws of as many runs, with replacement.
        confidence: Coverage of the band.
        seed: Of the draws.

    Returns:
        Lower and upper end of the band. Shape: (num_points,).
    """
    values = np.asarray(values, float)
    draws = np.random.default_rng(seed).integers(len(values), size=(resamples, len(values)))
    means = interquartile_mean(values[draws], axis=1)
    tail = 50 * (1 - confidence)
    lower, upper = np.percentile(means, [tail, 100 - tail], axis=0)
    return lower, upper


def on_grid(x: Array, y: Array, grid: Array) -> Array:
    """A curve's values at common places; after its end the last value holds.

    A run that stopped because it was solved counts as staying where it was.
    """
    if len(x) == 0:
        return np.zeros_like(grid)
    return np.interp(grid, x, y, left=0.0)
