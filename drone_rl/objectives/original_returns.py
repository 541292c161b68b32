"""The return estimators of the original study (`advantage_type` 0, 1, 3 and 4).

They are implemented as they were meant: an episode of constant return standardizes to zero instead
of dividing by zero, and the baselines of `time_baseline` never contain the episode that they are
subtracted from. Its variant 2 is `reward_to_go`. See `returns` for shapes and biases.
"""

from typing import Unpack

import torch
from torch import Tensor

from drone_rl.config import learning as settings
from drone_rl.config.registry import implements
from drone_rl.objectives.returns import (
    ROUNDING,
    Discounted,
    ReturnEstimator,
    ReturnKeys,
    alive,
    discount,
    pad,
    reward_to_go,
    total_reward,
    unpad,
)
from drone_rl.utils.errors import InputError


def standardized(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return, (g - mean) / std over each episode (Algorithm 4, line 2; footnote 5).

    The deviation is the population's; an episode of constant return gets zeros. Mean and deviation
    are the episode's own, so this is biased in batches of any size: an episode of one step teaches
    nothing, nor does, undiscounted, one that is rewarded at its end alone. With odds of 9 to 1 at
    the first step and 1 to 9 at the second, the angle is 38.7 degrees.
    """
    padded, lengths = pad(reward, done)
    returns = discount(padded, gamma)
    going = alive(lengths, returns)
    centred = returns - _mean(returns, going)
    deviation = _mean(centred.square(), going).sqrt()
    return unpad(torch.where(deviation > ROUNDING, centred / deviation, 0.0), lengths, reward)


def linear_ramp(reward: Tensor, done: Tensor) -> Tensor:
    """The episode's reward times a ramp from 1/T at its first step to 1 at its last.

    The ramp depends on how long the episode is yet to become, so this is biased in batches of any
    size: by 11.3 degrees.
    """
    padded, lengths = pad(reward, done)
    step = torch.arange(1, padded.shape[0] + 1, device=padded.device)[:, None]
    ramp = step / torch.tensor(lengths, device=padded.device)
    return unpad(padded.sum(0) * ramp, lengths, reward)


def success_scaled(reward: Tensor, done: Tensor, gamma: float, max_reward: float) -> Tensor:
    """Discounted return times exp(r(tau) - max_reward): episodes count by their success.

    Where an episode has one reward of 1 or none, that is a constant factor. Otherwise it is biased
    towards what succeeds wholly, if seldom: an even chance of 2 is preferred to 1.1 for sure.
    """
    scale = (total_reward(reward, done) - max_reward).exp()
    return reward_to_go(reward, done, gamma) * scale


def time_baseline(reward: Tensor, done: Tensor, gamma: float, baseline: Tensor) -> Tensor:
    """Return the discounted return minus a baseline for each time step of an episode; unbiased.

    The baseline (steps,) is from earlier episodes; times beyond its end have baseline 0.
    """
    padded, lengths = pad(reward, done)
    steps = min(len(baseline), len(padded))
    returns = discount(padded, gamma)
    returns[:steps] -= baseline[:steps, None]
    return unpad(returns, lengths, reward)


def mean_by_time(returns: Tensor, done: Tensor) -> tuple[Tensor, Tensor]:
    """Return mean and number of the episodes still going at each time step, (longest,)."""
    padded, lengths = pad(returns, done)
    count = alive(lengths, padded).sum(1)
    return padded.sum(1) / count, count


def _mean(padded: Tensor, going: Tensor) -> Tensor:
    return (padded * going).sum(0) / going.sum(0)


@implements(settings.Standardized)
class Standardized(Discounted):
    """Discounted return, standardized over each episode (Algorithm 4)."""

    function = staticmethod(standardized)


@implements(settings.LinearRamp)
class LinearRamp(ReturnEstimator):
    """The episode's reward times a ramp over the episode."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `linear_ramp`."""
        return linear_ramp(reward, done)


@implements(settings.SuccessScaled)
class SuccessScaled(Discounted):
    """Discounted return scaled by exp(reward - max_reward)."""

    def __init__(
        self,
        gamma: float | None = None,
        max_reward: float = settings.SuccessScaled().max_reward,
        **keys: Unpack[ReturnKeys],
    ) -> None:
        super().__init__(gamma, **keys)
        self.max_reward = max_reward

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `success_scaled`."""
        return success_scaled(reward, done, self.gamma, self.max_reward)


@implements(settings.TimeBaseline)
class TimeBaseline(Discounted):
    """Discounted return minus a running mean, over earlier episodes, for each time step."""

    baseline: Tensor
    """Means by time step. Shape: (max_steps,)."""
    seen: Tensor
    """Which steps have one. Shape: (max_steps,)."""

    def __init__(
        self,
        gamma: float | None = None,
        decay: float = settings.TimeBaseline().decay,
        max_steps: int = settings.TimeBaseline().max_steps,
        **keys: Unpack[ReturnKeys],
    ) -> None:
        """Allocate the means of `max_steps` time steps.

        `decay`, 0 or more and below 1, is the weight of the old mean at each batch.
        """
        super().__init__(gamma, **keys)
        if not 0.0 <= decay < 1.0:
            raise InputError(f"decay={decay} is out of range; give 0 or more, below 1")
        self.decay = decay
        self.register_buffer("baseline", torch.zeros(max_steps))
        self.register_buffer("seen", torch.zeros(max_steps, dtype=torch.bool))

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `time_baseline`; the running mean takes in this batch only afterwards."""
        values = time_baseline(reward, done, self.gamma, self.baseline)
        mean, _ = mean_by_time(reward_to_go(reward, done, self.gamma), done)
        steps = min(len(mean), len(self.baseline))
        old, mean, seen = self.baseline[:steps], mean[:steps], self.seen[:steps]
        blend = self.decay * old + (1 - self.decay) * mean
        self.baseline[:steps] = torch.where(seen, blend, mean)
        self.seen[:steps] = True
        return values
