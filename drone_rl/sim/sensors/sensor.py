"""Readings at a rate, told late, and held until the next one."""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.utils.batch import Batch

_ROUNDING = 1e-6
"""Share of a period by which a time that is summed up tick by tick may miss its mark."""


@dataclasses.dataclass
class Samples(Batch):
    """The latest readings of one sensor of `num_worlds` drones, the newest last."""

    began: Tensor  # (num_worlds,) float64
    """When the sensor was turned on, seconds."""
    count: Tensor  # (num_worlds,) int64
    """Readings that were due since then."""
    times: Tensor  # (num_worlds, slots) float64
    """When each was taken, seconds; minus infinity where there is none."""
    rows: Tensor  # (num_worlds, slots, width) float64
    """What each says."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sampling:
    """When readings are taken, and when they are told.

    The k-th is due `startup + k / rate` seconds after the start, k from 0, and is taken at the
    first time asked for from then on: so their mean rate is `rate` whatever the ticks. Where
    several are due at once, one is taken.
    """

    rate: float
    """Readings a second."""
    latency: float = 0.0
    """Seconds from taking a reading to telling it."""
    startup: float = 0.0
    """Seconds until the first is taken."""

    def start(self, time: Tensor, width: int) -> Samples:
        """Sensors that are turned on and have taken nothing yet.

        Args:
            time: Seconds. Shape: (num_worlds,), float64.
            width: Numbers that a reading has.
        """
        slots = math.ceil(self.latency * self.rate) + 2
        times = time.new_full((len(time), slots), -math.inf)
        rows = time.new_zeros(len(time), slots, width)
        return Samples(time.clone(), torch.zeros_like(time, dtype=torch.int64), times, rows)

    def due(self, samples: Samples, time: Tensor) -> Tensor:
        """Whose next reading is due. Shape: (num_worlds,), bool."""
        return self._count(samples, time) > samples.count

    def take(self, samples: Samples, time: Tensor, rows: Tensor) -> Samples:
        """The same with a reading more, of those whose next one is due.

        Args:
            samples: Before; they stay as they are.
            time: Now, seconds. Shape: (num_worlds,), float64.
            rows: What a reading would say now. Shape: (num_worlds, width), float64.
        """
        count = self._count(samples, time)
        is_due = (count > samples.count)[:, None]
        times = torch.cat([samples.times[:, 1:], time[:, None]], 1)
        taken = torch.cat([samples.rows[:, 1:], rows[:, None]], 1)
        return Samples(
            samples.began,
            torch.maximum(count, samples.count),
            torch.where(is_due, times, samples.times),
            torch.where(is_due[..., None], taken, samples.rows),
        )

    def read(self, samples: Samples, time: Tensor) -> tuple[Tensor, Tensor]:
        """The newest reading that is old enough to be told.

        Args:
            samples: Those taken until now.
            time: Now, seconds. Shape: (num_worlds,), float64.

        Returns:
            When it was taken, seconds, minus infinity where there is none yet. Shape:
            (num_worlds,). What it says, zeros where there is none. Shape: (num_worlds, width).
        """
        latest = (time - self.latency + _ROUNDING / self.rate)[:, None]
        newest = ((samples.times <= latest).sum(1) - 1).clamp(min=0)
        worlds = torch.arange(len(time), device=time.device)
        is_told = samples.times[worlds, newest] <= latest[:, 0]
        taken = torch.where(is_told, samples.times[worlds, newest], -math.inf)
        return taken, torch.where(is_told[:, None], samples.rows[worlds, newest], 0.0)

    def _count(self, samples: Samples, time: Tensor) -> Tensor:
        periods = (time - samples.began - self.startup) * self.rate
        return (torch.floor(periods + _ROUNDING) + 1).clamp(min=0).long()


def normal(like: Tensor, generator: torch.Generator) -> Tensor:
    """Normal numbers of mean 0 and deviation 1, of the shape, type and device of a tensor.

    They are drawn where the generator is: one of the CPU gives the same numbers on every device.
    """
    drawn = torch.randn(like.shape, dtype=like.dtype, generator=generator, device=generator.device)
    return drawn.to(like.device)


def random_walk_step(
    value: Tensor, strength: float, time: float, seconds: Tensor, generator: torch.Generator
) -> Tensor:
    """A random walk a step farther on.

    Args:
        value: Before. Shape: (num_worlds, n).
        strength: Standard deviation of what is added in `time`.
        time: Seconds.
        seconds: Length of the step. Shape: (num_worlds,).
        generator: Of the noise.
    """
    share = (seconds / time).clamp(min=0.0).sqrt()[:, None]
    return value + strength * share * normal(value, generator)


def gauss_markov_step(
    value: Tensor, strength: float, time: float, seconds: Tensor, generator: torch.Generator
) -> Tensor:
    """A Gauss-Markov process a step farther on: it forgets itself, and stays within bounds.

    Args:
        value: Before. Shape: (num_worlds, n).
        strength: Standard deviation after a long time, whatever the steps.
        time: Seconds in which 63% of the value is gauss_markov_step.
        seconds: Length of the step. Shape: (num_worlds,).
        generator: Of the noise.
    """
    kept = torch.exp(-seconds.clamp(min=0.0) / time)[:, None]
    return kept * value + strength * (1 - kept**2).sqrt() * normal(value, generator)
