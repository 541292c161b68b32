"""What goes wrong in a camera, as functions of pictures (*, C, H, W) from 0, black, to 1, white.

Nothing is drawn here: who calls has the random numbers, and may use the same ones at any strength.
"""

import math

import torch
from torch import Tensor


def correlate(noise: Tensor, fresh: Tensor, correlation_time: float) -> Tensor:
    """The noise of the next frame: an autoregressive process of first order, AR(1), in each pixel.

    Frames that are k apart correlate by exp(-k / correlation_time).

    Args:
        noise: Of this frame; of mean 0 and variance 1, which the next one's then has too.
        fresh: Independent numbers of the same kind and shape.
        correlation_time: Frames; at 0 the noise is white.
    """
    kept = math.exp(-1.0 / correlation_time) if correlation_time > 0 else 0.0
    return kept * noise + math.sqrt(1.0 - kept**2) * fresh


def add_noise(pictures: Tensor, strength: float, noise: Tensor) -> Tensor:
    """Noisy pictures, cut off at black and white as a sensor does.

    Args:
        pictures: Without noise. Shape: (*, C, H, W).
        strength: Standard deviation; the distance from black to white is 1.
        noise: Of mean 0 and variance 1. Shape: (*, C, H, W).
    """
    return (pictures + strength * noise).clamp(0.0, 1.0)


def blur(pictures: Tensor, width: float) -> Tensor:
    """Pictures convolved with a Gaussian; what is beyond an edge is as on the edge.

    Args:
        pictures: Shape (*, C, H, W).
        width: Standard deviation of the Gaussian, pixels; 0 leaves pictures alone.
    """
    if width == 0:
        return pictures
    weights = gaussian(width)
    return _convolved(_convolved(pictures, weights, -2), weights, -1)


def gaussian(width: float) -> list[float]:
    """Samples of a Gaussian at whole pixels up to four deviations from its middle; sum 1.

    The deviation of so few samples is less than that of the Gaussian where this is below 0.6.

    Args:
        width: Its standard deviation, pixels; above 0.
    """
    radius = math.ceil(4 * width)
    samples = [math.exp(-0.5 * (x / width) ** 2) for x in range(-radius, radius + 1)]
    return [sample / math.fsum(samples) for sample in samples]


def _convolved(pictures: Tensor, weights: list[float], dim: int) -> Tensor:
    """Sums of shifted pictures: unlike a library's convolution the same in a batch of any size."""
    size, radius = pictures.shape[dim], len(weights) // 2
    near = torch.arange(-radius, size + radius, device=pictures.device).clamp(0, size - 1)
    padded = pictures.index_select(dim, near)
    total = weights[0] * padded.narrow(dim, 0, size)
    for i, weight in enumerate(weights[1:], 1):
        total = total + weight * padded.narrow(dim, i, size)
    return total


def shift(pictures: Tensor, by: Tensor) -> Tensor:
    """Pictures that stand aside; what comes in is as on the edge.

    Args:
        pictures: Shape (*, C, H, W).
        by: How far down and to the right, pixels. Shape: (*, 2), int64.
    """
    for dim, far in ((-2, by[..., :1]), (-1, by[..., 1:])):
        size = pictures.shape[dim]
        there = torch.arange(size, device=pictures.device)
        rows = (there - far).clamp(0, size - 1)[..., None, :]
        rows = rows[..., None] if dim == -2 else rows[..., None, :]
        pictures = pictures.gather(dim, rows.expand(pictures.shape))
    return pictures


def choose_rows(numbers: Tensor, count: int) -> Tensor:
    """Which rows are dead: those of the smallest numbers, so that more rows include fewer.

    Args:
        numbers: One for each row, independent. Shape: (*, H).
        count: Dead rows.

    Returns:
        Shape: (*, H), bool.
    """
    return numbers.argsort(dim=-1).argsort(dim=-1) < count


def kill_rows(pictures: Tensor, dead: Tensor, level: float = 0.0) -> Tensor:
    """Pictures in which dead rows show nothing.

    Args:
        pictures: Shape (*, C, H, W).
        dead: Which rows. Shape: (*, H), bool.
        level: What they show instead; 0 is black, 1 white.
    """
    return torch.where(dead[..., None, :, None], level, pictures)


def freeze(pictures: Tensor, before: Tensor, is_frozen: Tensor) -> Tensor:
    """What is shown where some frames are the ones before.

    Args:
        pictures: Of now. Shape: (*, C, H, W).
        before: What was shown before. Shape: (*, C, H, W).
        is_frozen: Shape (*), bool.
    """
    return torch.where(is_frozen[..., None, None, None], before, pictures)


def delay(film: Tensor, frames: int) -> Tensor:
    """A film that is shown late; until then it shows its first picture.

    Args:
        film: Pictures of one time after the other. Shape: (T, *).
        frames: How late.
    """
    return film[(torch.arange(len(film), device=film.device) - frames).clamp(min=0)]
