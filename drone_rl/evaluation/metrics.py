"""How good a policy is: pure functions of finished episodes, with exact intervals."""

import dataclasses
from typing import Any

from torch import Tensor

from drone_rl.sim.rules import EndReason, Side
from drone_rl.utils.intervals import proportion


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
