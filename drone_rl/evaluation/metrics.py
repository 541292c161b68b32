"""How good a policy is: pure functions of finished episodes, each of which counts once.

An episode's cubes depend on one another: who leaves after the first cube misses all the others.
So every interval rests on one value an episode.
"""

import dataclasses
from typing import Any

from torch import Tensor

from drone_rl.sim.tasks.collect_cubes.rules import EndReason, Side
from drone_rl.utils.intervals import mean_bounds, proportion

ENDS = tuple(reason for reason in EndReason if reason is not EndReason.RUNNING)
"""How an episode can end."""


@dataclasses.dataclass
class Episodes:
    """Finished episodes; `n` is their number, `C` the number of cubes."""

    collected: Tensor  # (n, C) bool
    """Which cubes were collected."""
    side: Tensor  # (n, C) int64
    """`Side` of each cube when it became the next one; -1 if it never did."""
    lateral: Tensor  # (n, C) float64
    """Metres to the left of the drone at which it stood then; NaN if it never did."""
    height: Tensor  # (n, C) float64
    """Metres by which each cube stands higher than the drone."""
    end_reason: Tensor  # (n,) int64
    """`EndReason` of each."""
    length: Tensor  # (n,) int64
    """Steps of each."""

    def __len__(self) -> int:
        """Returns the number of episodes."""
        return len(self.length)

    def __getitem__(self, rows: slice | Tensor) -> "Episodes":
        """Returns some of the episodes."""
        return Episodes(**{name: value[rows] for name, value in vars(self).items()})

    @property
    def success(self) -> Tensor:
        """1 where every cube was collected, else 0. Shape: (n,), float64."""
        return self.collected.all(-1).double()

    @property
    def share(self) -> Tensor:
        """Each episode's share of cubes collected; the never reached are missed. Shape: (n,)."""
        return self.collected.double().mean(-1)

    def offered(self, side: Side) -> Tensor:
        """Episodes in which some cube became the next one on this side. Shape: (n,), bool."""
        return (self.side == side).any(-1)

    def side_share(self, side: Side) -> Tensor:
        """The share of the cubes on a side that each episode that offered one collected.

        Returns:
            Shape: (number of such episodes,), float64.
        """
        cubes = (self.side == side)[self.offered(side)]
        return (cubes & self.collected[self.offered(side)]).sum(-1).double() / cubes.sum(-1)


def summarise(episodes: Episodes) -> dict[str, Any]:
    """The figures of an evaluation, as plain values, with intervals that count episodes.

    "success" is the share of episodes in which every cube was collected. "shares" are means over
    episodes of the share of cubes that an episode collected: of all, and of those that became the
    next one on a side, over the episodes that offered such a cube; a mean of None says that none
    was offered. Cubes that never became the next one ("never_reached") count among all as missed.
    """
    shares = {"all": _share(episodes.share, episodes.collected.numel())}
    for side in Side:
        cubes = int((episodes.side == side).sum())
        shares[side.name.lower()] = _share(episodes.side_share(side), cubes)
    ends = {
        reason.name.lower(): proportion(int((episodes.end_reason == reason).sum()), len(episodes))
        for reason in ENDS
    }
    return {
        "episodes": len(episodes),
        "success": proportion(int(episodes.success.sum()), len(episodes)),
        "shares": shares,
        "never_reached": mean_bounds((episodes.side < 0).double().mean(-1)),
        "ends": ends,
        "mean_cubes": float(episodes.collected.sum(-1).double().mean()),
        "mean_length": float(episodes.length.double().mean()),
        "max_length": int(episodes.length.max()),
    }


def _share(values: Tensor, cubes: int) -> dict[str, Any]:
    return {**mean_bounds(values), "cubes": cubes}
