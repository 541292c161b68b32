"""Result of a third-party training, and the criterion for solving the task."""

import dataclasses

from drone_rl.policies.external_policy import ExternalPolicy

TARGET, DECAY = 2.97, 0.99
"""Target and decay of the running mean of episode rewards, which starts at 0."""


@dataclasses.dataclass(frozen=True)
class PeerTraining:
    """Result of a training."""

    is_solved: bool
    """Whether the running mean has reached the target."""
    frames: int
    running_reward: float
    policy: ExternalPolicy
    """The trained policy, for evaluation in held-out environments."""
