"""Return estimators, one for each of `objectives.returns`; they write "return_to_go".

All but `TotalReward` and `LinearRamp` have a discount rate `gamma` in [0, 1] and raise `InputError`
for another; the other arguments are those of `ReturnEstimator`.
"""

from typing import Any

import torch
from torch import Tensor
from torchrl.objectives.value import GAE

from drone_rl.config import learning as settings
from drone_rl.config.learning import Gae
from drone_rl.config.registry import implements
from drone_rl.objectives import returns
from drone_rl.objectives.return_estimator import ReturnEstimator
from drone_rl.utils.errors import InputError


class _Discounted(ReturnEstimator):
    def __init__(self, gamma: float | None = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        own: Any = self.Settings
        self.gamma: float = own.gamma if gamma is None else gamma
        if not 0.0 <= self.gamma <= 1.0:
            raise InputError(f"gamma={gamma} is out of range; give a rate from 0 to 1")


@implements(settings.TotalReward)
class TotalReward(ReturnEstimator):
    """The whole episode's reward at every step (Eq. 12)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.total_reward`."""
        return returns.total_reward(reward, done)


@implements(settings.RewardToGo)
class RewardToGo(_Discounted):
    """Discounted return (Eq. 14)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.reward_to_go`."""
        return returns.reward_to_go(reward, done, self.gamma)


@implements(settings.Standardised)
class Standardised(_Discounted):
    """Discounted return, standardised over each episode (Algorithm 4)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.standardised`."""
        return returns.standardised(reward, done, self.gamma)


@implements(settings.LinearRamp)
class LinearRamp(ReturnEstimator):
    """The episode's reward times a ramp over the episode."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.linear_ramp`."""
        return returns.linear_ramp(reward, done)


@implements(settings.SuccessScaled)
class SuccessScaled(_Discounted):
    """Discounted return scaled by exp(reward - max_reward)."""

    def __init__(
        self,
        gamma: float | None = None,
        max_reward: float = settings.SuccessScaled.max_reward,
        **kwargs: Any,
    ) -> None:
        super().__init__(gamma, **kwargs)
        self.max_reward = max_reward

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.success_scaled`."""
        return returns.success_scaled(reward, done, self.gamma, self.max_reward)


@implements(settings.TimeBaseline)
class TimeBaseline(_Discounted):
    """Discounted return minus a running mean, over earlier episodes, for each time step."""

    baseline: Tensor
    """Means by time step. Shape: (max_steps,)."""
    seen: Tensor
    """Which steps have one. Shape: (max_steps,)."""

    def __init__(
        self,
        gamma: float | None = None,
        decay: float = settings.TimeBaseline.decay,
        max_steps: int = settings.TimeBaseline.max_steps,
        **kwargs: Any,
    ) -> None:
        """Sets the memory.

        Args:
            gamma: Discount rate.
            decay: Share of the old mean that is kept at each batch.
            max_steps: Time steps that have a mean of their own.
            kwargs: See `ReturnEstimator`.

        Raises:
            InputError: decay is out of range.
        """
        super().__init__(gamma, **kwargs)
        if not 0.0 <= decay < 1.0:
            raise InputError(f"decay={decay} is out of range; give 0 or more, below 1")
        self.decay = decay
        self.register_buffer("baseline", torch.zeros(max_steps))
        self.register_buffer("seen", torch.zeros(max_steps, dtype=torch.bool))

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.time_baseline`; the running mean takes in this batch only afterwards."""
        values = returns.time_baseline(reward, done, self.gamma, self.baseline)
        mean, _ = returns.mean_by_time(returns.reward_to_go(reward, done, self.gamma), done)
        known = min(len(mean), len(self.baseline))
        old, mean, seen = self.baseline[:known], mean[:known], self.seen[:known]
        blend = self.decay * old + (1 - self.decay) * mean
        self.baseline[:known] = torch.where(seen, blend, mean)
        self.seen[:known] = True
        return values


@implements(settings.LeaveOneOut)
class LeaveOneOut(_Discounted):
    """Discounted return minus the other episodes' mean at the same time step."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.leave_one_out`."""
        return returns.leave_one_out(reward, done, self.gamma)


@implements(settings.BatchNormalised)
class BatchNormalised(_Discounted):
    """Discounted return, normalised over the batch."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.batch_normalised`."""
        return returns.batch_normalised(reward, done, self.gamma)


@implements(Gae)
class Advantages(GAE):
    """Generalised advantage estimates, as `GAE` makes them of values that a batch holds.

    Reads "state_value", ("next", "state_value") and ("next", ...) "reward", "done", "terminated";
    writes "advantage" and "value_target". Shapes: (*batch, T, 1). Beyond a step that is not
    `terminated` the value of what follows counts, be the row cut there or not.
    """

    def __init__(
        self, gamma: float = Gae.gamma, lmbda: float = Gae.lmbda, scale: bool = Gae.scale
    ) -> None:
        """Sets discount rate, weight of later estimates, and whether to standardize a batch."""
        super().__init__(gamma=gamma, lmbda=lmbda, value_network=None, average_gae=scale)
