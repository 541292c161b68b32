"""Noise of sensors: white, walking, or forgetting itself; each from the caller's own stream."""

import torch
from torch import Tensor


def normal(like: Tensor, generator: torch.Generator) -> Tensor:
    """Normal numbers of mean 0 and deviation 1, of the shape, type and device of a tensor.

    They are drawn where the generator is: one of the CPU gives the same numbers on every device.
    """
    drawn = torch.randn(like.shape, dtype=like.dtype, generator=generator, device=generator.device)
    return drawn.to(like.device)


def walked(
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


def forgotten(
    value: Tensor, strength: float, time: float, seconds: Tensor, generator: torch.Generator
) -> Tensor:
    """A Gauss-Markov process a step farther on: it forgets itself, and stays within bounds.

    Args:
        value: Before. Shape: (num_worlds, n).
        strength: Standard deviation after a long time, whatever the steps.
        time: Seconds in which 63% of the value is forgotten.
        seconds: Length of the step. Shape: (num_worlds,).
        generator: Of the noise.
    """
    kept = torch.exp(-seconds.clamp(min=0.0) / time)[:, None]
    return kept * value + strength * (1 - kept**2).sqrt() * normal(value, generator)
