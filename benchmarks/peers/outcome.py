"""What comes of a training by anybody, and when it is called solved."""

import dataclasses

from drone_rl.policies.external_policy import ForeignPolicy

TARGET, DECAY = 2.97, 0.99
"""Of the running mean of the episodes' rewards, which begins at 0; and what an episode leaves."""


@dataclasses.dataclass(frozen=True)
class PeerTraining:
    """What came of a training."""

    is_solved: bool
    """Whether the running mean has reached the target."""
    frames: int
    running_reward: float
    policy: ForeignPolicy
    """The policy, to be judged in worlds that it was not trained in."""
