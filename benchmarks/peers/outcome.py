"""Result of a third-party training, and the criterion for solving the task."""

import dataclasses

from drone_rl.policies.external_policy import ExternalPolicy

Curve = list[tuple[float, float]]
"""Seconds and running mean of episode rewards, after each batch."""
TARGET, DECAY = 2.97, 0.99
"""Target and decay of the running mean of episode rewards, which starts at 0."""


@dataclasses.dataclass(frozen=True)
class PeerTraining:
    """Result of a training."""

    is_solved: bool
    """Whether the running mean has reached the target."""
    frames: int
    history: Curve
    """Seconds since the epoch and running mean of episode rewards, after each batch."""
    policy: ExternalPolicy
    """The trained policy, for evaluation in held-out environments."""
