"""How far a training is, and what others see of it."""

import dataclasses
from typing import Any, Protocol


@dataclasses.dataclass
class Progress:
    """How far a training is."""

    frames: int = 0
    episodes: int = 0
    updates: int = 0
    seconds: float = 0.0
    """Time spent, over all resumptions."""
    running_reward: float = 0.0
    """Running mean of the episodes' rewards, from 0, as in the original study."""


class OngoingTraining(Protocol):
    """What a callback sees of a training, and may ask of it."""

    progress: Progress
    total_frames: int
    """After how many it stops."""
    stop_request: str
    """Why a callback wants training to stop after this update; empty to go on."""

    def state_dict(self) -> dict[str, Any]:
        """Everything that the next update depends on."""
        ...
