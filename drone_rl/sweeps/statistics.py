"""What several runs say together, with intervals that hold for any number: pure functions."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.intervals import median_bounds, proportion

Array = NDArray[np.float64]


def share_of_runs(successes: int, unknown: int, trials: int) -> dict[str, Any]:
    """A share of runs, with an interval that holds whatever the unknown ones were.

    Args:
        successes: Runs of which it is known.
        unknown: Runs of which it can't be known; they may all be successes, or none.
        trials: All runs, the unknown ones included.

    Returns:
        As `proportion`, with "unknown".
    """
    upper = proportion(successes + unknown, trials)["upper95"]
    return {**proportion(successes, trials), "upper95": upper, "unknown": unknown}


def median_of_runs(values: Sequence[float], had: Sequence[float] | None = None) -> dict[str, Any]:
    """The median over runs with its exact interval; of what was never reached, what is known.

    Args:
        values: One a run; infinite where a run ended without reaching it.
        had: What each run had when it ended, which such a run would have needed more than.

    Returns:
        "median" (None of no runs, or if at least half never reached it), "more_than" (what is
        known instead), "lower95" and "upper95" (None of fewer than six runs; "upper95" also if it
        has no bound) and "runs".
    """
    least = values if had is None else had
    middle = float(np.median(values)) if len(values) else None
    low, high = median_bounds(least), median_bounds(values)
    return {
        "median": middle if middle is not None and np.isfinite(middle) else None,
        "more_than": float(np.median(least)) if middle == float("inf") else None,
        "lower95": None if low is None else low[0],
        "upper95": None if high is None or not np.isfinite(high[1]) else high[1],
        "runs": len(values),
    }


def median_band(values: Array) -> tuple[Array, Array] | None:
    """The exact interval of the median at each place by itself.

    Args:
        values: One row a run. Shape: (num_runs, num_points).

    Returns:
        Lower and upper end, of shape (num_points,) each; None of fewer than six runs.
    """
    bounds = [median_bounds(column) for column in np.asarray(values, float).T]
    known = [pair for pair in bounds if pair is not None]
    if not known:
        return None
    lower, upper = np.array(known).T
    return lower, upper


def on_grid(x: Array, y: Array, grid: Array) -> Array:
    """A curve's values at common places; it begins at nothing, and stays where it ended.

    Args:
        x: Increasing places; of a run that came to nothing, none. Shape: (n,).
        y: Values there. Shape: (n,).
        grid: Common places.
    """
    if len(x) == 0:
        return np.zeros_like(grid)
    return np.interp(grid, x, y, left=0.0)
