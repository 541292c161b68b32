"""How good a policy is: pure functions of finished episodes, with exact intervals."""

import dataclasses
from typing import Any

from scipy.stats import beta
from torch import Tensor

from drone_rl.sim.rules import EndReason, Side


@dataclasses.dataclass
class Episodes:
    """Finished episodes; `C` is the number of cubes."""

    collected: Tensor  # (num_episodes, C) bool
    """Which cubes were collected."""
    side: Tensor  # (num_episodes, C) int64
    """`Side` of each cube when it became the next one; -1 if it never did."""
    end_reason: Tensor  # (num_episodes,) int64
    """`EndReason` of each."""
    length: Tensor  # (num_episodes,) int64
    """Steps of each."""


def proportion(successes: int, trials: int, confidence: float = 0.95) -> dict[str, Any]:
    """A share with its exact (Clopper-Pearson) interval.

    Args:
        successes: How many succeeded.
        trials: Out of how many; 0 gives a share of None and the interval [0, 1].
        confidence: Coverage of the interval.
    """
    alpha = 1.0 - confidence
    lower = float(beta.ppf(alpha / 2, successes, trials - successes + 1)) if successes else 0.0
    upper = (
        float(beta.ppf(1 - alpha / 2, successes + 1, trials - successes))
        if successes < trials
        else 1.0
    )
    return {
        "share": successes / trials if trials else None,
        "lower95": lower,
        "upper95": upper,
        "successes": successes,
        "trials": trials,
    }


def summarise(episodes: Episodes) -> dict[str, Any]:
    """The figures of an evaluation, as plain values.

    "by_side" counts the cubes that became the next one on that side, and the share of them that
    was collected.
    """
    cubes = episodes.collected.sum(-1).double()
    by_side = {}
    for side in Side:
        offered = episodes.side == side
        hits = int((offered & episodes.collected).sum())
        by_side[side.name.lower()] = proportion(hits, int(offered.sum()))
    reasons = {
        reason.name.lower(): int((episodes.end_reason == reason).sum())
        for reason in EndReason
        if reason is not EndReason.RUNNING
    }
    length = episodes.length.double()
    return {
        "episodes": len(cubes),
        "mean_cubes": float(cubes.mean()),
        "std_cubes": float(cubes.std(correction=0)),
        "all_cubes": proportion(int(episodes.collected.all(-1).sum()), len(cubes)),
        "by_side": by_side,
        "end_reason": reasons,
        "mean_length": float(length.mean()),
        "max_length": int(length.max()),
    }
