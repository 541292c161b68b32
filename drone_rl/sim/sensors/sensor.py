"""What sensors share: sampling at a rate with latency, noise processes, and the base class."""

import abc
import dataclasses
import math
from typing import Generic, TypeVar

import torch
from torch import Generator, Tensor

from drone_rl.sim.dynamics.state import BodyState
from drone_rl.utils.batch import Batch

_ROUNDING = 1e-6
"""Fraction of a period by which a time that is summed tick by tick may miss its mark."""


@dataclasses.dataclass
class Samples(Batch):
    """The latest readings of one sensor of `num_envs` drones, the newest last."""

    began: Tensor  # (num_envs,) float64
    """When the sensor was switched on, seconds."""
    count: Tensor  # (num_envs,) int64
    """Readings that were due since then."""
    times: Tensor  # (num_envs, slots) float64
    """When each was taken, seconds; minus infinity for none."""
    rows: Tensor  # (num_envs, slots, width) float64


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sampling:
    """When readings are taken and delivered. Times: seconds, shape (num_envs,), float64.

    Reading k = 0, 1, ... is due `startup + k / rate` seconds after the start, and is taken at the
    first update from then on, so the mean rate is `rate` if ticks are no longer than 1 / `rate`. If
    several are due at once, one is taken: longer ticks have one reading each.
    """

    rate: float
    """Readings per second."""
    latency: float = 0.0
    """Seconds from taking a reading to delivering it."""
    startup: float = 0.0
    """Seconds until the first is taken."""

    def start(self, time: Tensor, width: int) -> Samples:
        """Return sensors that are switched on now, without readings of `width` numbers yet."""
        slots = math.ceil(self.latency * self.rate) + 2
        times = time.new_full((len(time), slots), -math.inf)
        rows = time.new_zeros(len(time), slots, width)
        return Samples(time.clone(), torch.zeros_like(time, dtype=torch.int64), times, rows)

    def due(self, samples: Samples, time: Tensor) -> Tensor:
        """Return where the next reading is due. Shape: (num_envs,), bool."""
        return self._count(samples, time) > samples.count

    def take(self, samples: Samples, time: Tensor, rows: Tensor) -> Samples:
        """Append a reading `rows`, shape (num_envs, width), float64, where one is due."""
        count = self._count(samples, time)
        is_due = count > samples.count
        times = torch.cat([samples.times[:, 1:], time[:, None]], 1)
        taken = torch.cat([samples.rows[:, 1:], rows[:, None]], 1)
        return Samples(
            samples.began,
            torch.maximum(count, samples.count),
            select(is_due, times, samples.times),
            select(is_due, taken, samples.rows),
        )

    def read(self, samples: Samples, time: Tensor) -> tuple[Tensor, Tensor]:
        """Return the newest reading that is old enough to be delivered: its time and values.

        Times, (num_envs,), are minus infinity and values, (num_envs, width), zeros for none.
        """
        latest = (time - self.latency + _ROUNDING / self.rate)[:, None]
        newest = ((samples.times <= latest).sum(1) - 1).clamp(min=0)
        worlds = torch.arange(len(time), device=time.device)
        is_delivered = samples.times[worlds, newest] <= latest[:, 0]
        taken = torch.where(is_delivered, samples.times[worlds, newest], -math.inf)
        return taken, torch.where(is_delivered[:, None], samples.rows[worlds, newest], 0.0)

    def _count(self, samples: Samples, time: Tensor) -> Tensor:
        periods = (time - samples.began - self.startup) * self.rate
        return (torch.floor(periods + _ROUNDING) + 1).clamp(min=0).long()


@dataclasses.dataclass
class SensorState(Batch):
    """State of one sensor of `num_envs` drones."""

    samples: Samples


State = TypeVar("State", bound=SensorState)
Reading = TypeVar("Reading")


class Sensor(abc.ABC, Generic[State, Reading]):
    """A sensor of a batch of drones; states are immutable, and noise is sampled for all at once."""

    sampling: Sampling

    def start(self, body: BodyState, time: Tensor, generator: Generator) -> State:
        """Switch the sensors on; those without start-up time take a reading. See `update`."""
        return self.update(self._initial(body, time, generator), body, time, generator)

    def update(self, state: State, body: BodyState, time: Tensor, generator: Generator) -> State:
        """Return the sensors at a later time (seconds); a reading is taken where one is due."""
        is_due = self.sampling.due(state.samples, time)
        return self._sample(state, body, time, generator) if is_due.any() else state

    def read(self, state: State, time: Tensor) -> Reading:
        """Return the readings that are delivered at a time (seconds, shape (num_envs,))."""
        return self._reading(*self.sampling.read(state.samples, time))

    @abc.abstractmethod
    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> State:
        """Return the state of sensors that are switched on now, see `start`."""

    @abc.abstractmethod
    def _sample(self, state: State, body: BodyState, time: Tensor, generator: Generator) -> State:
        """Take a reading where one is due, see `update`."""

    @abc.abstractmethod
    def _reading(self, time: Tensor, rows: Tensor) -> Reading:
        """Return readings from the rows that `_sample` stored; see `read`."""


def select(condition: Tensor, chosen: Tensor, other: Tensor) -> Tensor:
    """Choose rows of two tensors. Shapes: (num_envs,) and (num_envs, *)."""
    return torch.where(condition.view(-1, *[1] * (chosen.ndim - 1)), chosen, other)


def normal(like: Tensor, generator: Generator) -> Tensor:
    """Sample standard normal numbers like a tensor; a CPU generator gives the same anywhere."""
    device = generator.device
    sampled = torch.randn(like.shape, dtype=like.dtype, generator=generator, device=device)
    return sampled.to(like.device)


def random_walk_step(
    value: Tensor, strength: float, time: float, seconds: Tensor, generator: Generator
) -> Tensor:
    """Advance a random walk, shape (num_envs, n), by some seconds, shape (num_envs,).

    `strength` is the standard deviation of the increment over `time` seconds.
    """
    scale = (seconds / time).clamp(min=0.0).sqrt()[:, None]
    return value + strength * scale * normal(value, generator)


def gauss_markov_step(
    value: Tensor, strength: float, time: float, seconds: Tensor, generator: Generator
) -> Tensor:
    """Advance a first-order Gauss-Markov process by one step; see `random_walk_step`.

    `strength` is its stationary standard deviation, `time` its time constant in seconds.
    """
    kept = torch.exp(-seconds.clamp(min=0.0) / time)[:, None]
    return kept * value + strength * (1 - kept**2).sqrt() * normal(value, generator)
