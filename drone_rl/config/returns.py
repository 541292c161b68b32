"""Return estimators: what a step of an episode is worth."""

import dataclasses
from typing import Annotated, ClassVar

from drone_rl.config.variant import Variant
from drone_rl.utils.schema import Real, Whole

Rate = Annotated[float, Real(0.0, 1.0)]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Returns(Variant):
    """Which estimator, and with which values."""

    scale: bool = False
    """Whether to divide a batch's returns by their root mean square."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Discounted(Returns):
    gamma: Rate = 0.99
    """Discount rate, 0 to 1."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class TotalReward(Returns):
    """The whole episode's reward at every step (Eq. 12)."""

    target: ClassVar[str] = "drone_rl.objectives.TotalReward"


@dataclasses.dataclass(frozen=True, kw_only=True)
class LinearRamp(Returns):
    """The episode's reward times a ramp over the episode (variant 1)."""

    target: ClassVar[str] = "drone_rl.objectives.LinearRamp"


@dataclasses.dataclass(frozen=True, kw_only=True)
class RewardToGo(_Discounted):
    """Discounted return (Eq. 14; the original's variant 2)."""

    target: ClassVar[str] = "drone_rl.objectives.RewardToGo"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Standardised(_Discounted):
    """Discounted return, standardised over each episode (Algorithm 4; variant 0)."""

    target: ClassVar[str] = "drone_rl.objectives.Standardised"


@dataclasses.dataclass(frozen=True, kw_only=True)
class SuccessScaled(_Discounted):
    """Discounted return scaled by exp(reward - max_reward) (variant 3)."""

    target: ClassVar[str] = "drone_rl.objectives.SuccessScaled"
    max_reward: Annotated[float, Real(0.0, 1e6)] = 3.0
    """Reward of a perfect episode: the task's cubes."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class TimeBaseline(_Discounted):
    """Discounted return minus a running mean for each time step (variant 4)."""

    target: ClassVar[str] = "drone_rl.objectives.TimeBaseline"
    scale: bool = True
    """Whether to divide a batch's returns by their root mean square."""
    decay: Annotated[float, Real(0.0, 1.0, is_below=True)] = 0.9
    """Share of the old mean that is kept at each batch, 0 to below 1."""
    max_steps: Annotated[int, Whole(1, 100_000, "steps")] = 300
    """Time steps that have a mean of their own: the task's limit."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LeaveOneOut(_Discounted):
    """Discounted return minus the other episodes' mean at the same time step."""

    target: ClassVar[str] = "drone_rl.objectives.LeaveOneOut"
    scale: bool = True
    """Whether to divide a batch's returns by their root mean square."""
    gamma: Rate = 0.95
    """Discount rate, 0 to 1."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BatchNormalised(_Discounted):
    """Discounted return, normalised over the batch."""

    target: ClassVar[str] = "drone_rl.objectives.BatchNormalised"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Gae(_Discounted):
    """Generalised advantage estimates, for objectives with a critic."""

    target: ClassVar[str] = "drone_rl.objectives.Advantages"
    scale: bool = True
    """Whether to standardise a batch's advantages."""
    gamma: Rate = 0.95
    """Discount rate, 0 to 1."""
    lmbda: Rate = 0.95
    """Weight of estimates that look one step farther, 0 to 1; 0 looks one step."""
