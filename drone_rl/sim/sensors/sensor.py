"""What sensors share: sampling at a rate with latency, and noise processes."""

import abc
import collections
import math
from typing import Generic, Protocol, TypeVar

import torch
from torch import Generator, Tensor

from drone_rl.sim.dynamics.state import BodyState

_ROUNDING = 1e-6
"""Fraction of a period by which a time that is summed tick by tick may miss its mark."""


class _Timed(Protocol):
    @property
    def time(self) -> float: ...


Reading = TypeVar("Reading", bound=_Timed)


class Sensor(abc.ABC, Generic[Reading]):
    """A sensor of one drone, switched on at time 0.

    Reading k = 0, 1, ... is due `startup + k / rate` seconds after the start, and is taken at the
    first update from then on, so the mean rate is `rate` if ticks are no longer than 1 / `rate`. If
    several are due at once, one is taken: longer ticks have one reading each.
    """

    def __init__(
        self, none: Reading, rate: float, *, latency: float = 0.0, startup: float = 0.0
    ) -> None:
        """Create a sensor without readings.

        Args:
            none: What is delivered before the first reading.
            rate: Readings per second.
            latency: Seconds from taking a reading to delivering it.
            startup: Seconds until the first is taken.
        """
        self._none, self._rate, self._latency, self._startup = none, rate, latency, startup
        self._count, self._time = 0, 0.0
        self._readings: collections.deque[Reading] = collections.deque(
            maxlen=math.ceil(latency * rate) + 2
        )

    def update(self, body: BodyState, time: float) -> None:
        """Go on to a later time, seconds, at which the drone is `body`; take a reading if due."""
        self._time = time
        count = math.floor((time - self._startup) * self._rate + _ROUNDING) + 1
        if count > self._count:
            self._count = count
            self._readings.append(self._sample(body, time))

    def read(self) -> Reading:
        """Return the newest reading that is old enough to be delivered."""
        latest = self._time - self._latency + _ROUNDING / self._rate
        return next((one for one in reversed(self._readings) if one.time <= latest), self._none)

    @abc.abstractmethod
    def _sample(self, body: BodyState, time: float) -> Reading:
        """Take a reading."""


def normal(like: Tensor, generator: Generator) -> Tensor:
    """Sample standard normal numbers like a tensor."""
    return torch.randn(like.shape, dtype=like.dtype, generator=generator)


def random_walk_step(
    value: Tensor, strength: float, time: float, seconds: float, generator: Generator
) -> Tensor:
    """Advance a random walk by some seconds.

    `strength` is the standard deviation of the increment over `time` seconds.
    """
    return value + strength * math.sqrt(seconds / time) * normal(value, generator)


def gauss_markov_step(
    value: Tensor, strength: float, time: float, seconds: float, generator: Generator
) -> Tensor:
    """Advance a first-order Gauss-Markov process by some seconds.

    `strength` is its stationary standard deviation, `time` its time constant in seconds.
    """
    kept = math.exp(-seconds / time)
    return kept * value + strength * math.sqrt(1 - kept**2) * normal(value, generator)
