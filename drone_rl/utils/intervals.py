"""Exact intervals of shares."""

from typing import Any

from scipy.special import betaincinv


def proportion(successes: int, trials: int, confidence: float = 0.95) -> dict[str, Any]:
    """A share with its exact (Clopper-Pearson) interval.

    Args:
        successes: How many succeeded.
        trials: Out of how many; 0 gives a share of None and the interval [0, 1].
        confidence: Coverage of the interval.
    """
    tail, failures = (1.0 - confidence) / 2, trials - successes
    lower = float(betaincinv(successes, failures + 1, tail)) if successes else 0.0
    upper = float(betaincinv(successes + 1, failures, 1.0 - tail)) if failures else 1.0
    return {
        "share": successes / trials if trials else None,
        "lower95": lower,
        "upper95": upper,
        "successes": successes,
        "trials": trials,
    }
