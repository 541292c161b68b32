"""Camera faults as functions of images and a memory, whatever the source of random numbers.

Images are floats of shape (*, C, H, W) from 0 (black) to 1 (white).
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Protocol

import torch
from torch import Tensor


class Sample(Protocol):
    """Source of random numbers of some environments."""

    def __call__(self, *shape: int, normal: bool = False) -> Tensor:
        """Sample standard normal numbers, or from 0 to 1. Shape: (num_envs, *shape)."""
        ...


@dataclasses.dataclass(frozen=True)
class FaultModel:
    """A camera fault of independent environments. Images have shape (n, C, H, W)."""

    show: Callable[[Tensor, Tensor, float], Tensor] = lambda images, memory, blank: images
    """Return the faulty images, from images, memory and the value of a pixel without signal."""
    begin: Callable[[Tensor, Sample], Tensor] = lambda images, sample: images[:, :0]
    """Return the memory at the first images of episodes. Shape: (n, *)."""
    update: Callable[[Tensor, Tensor, Sample], Tensor] = lambda memory, images, sample: memory
    """Return the memory at the next images, from the previous memory."""
    hides: bool = False
    """Whether the fault can hide objects."""


def noise(strength: float, correlation_time: float = 0.0) -> FaultModel:
    """Add noise of standard deviation `strength`, clipped at black and white; see `correlate`."""

    def begin(images: Tensor, sample: Sample) -> Tensor:
        return sample(*images.shape[1:], normal=True)

    def update(memory: Tensor, images: Tensor, sample: Sample) -> Tensor:
        return correlate(memory, begin(images, sample), correlation_time)

    def show(images: Tensor, memory: Tensor, blank: float) -> Tensor:
        return (images + strength * memory).clamp(0.0, 1.0)

    return FaultModel(show, begin, update)


def bias(most: float) -> FaultModel:
    """Add a constant of each episode, uniform within `most`, clipped at black and white."""
    return FaultModel(
        lambda images, memory, _: (images + memory).clamp(0.0, 1.0),
        lambda images, sample: most * (2 * sample(1, 1, 1) - 1),
    )


def dead_rows(count: int, rows: Sequence[int] = (), level: float | None = None) -> FaultModel:
    """Blank `count` random rows per episode and always `rows`; `level` overrides the blank.

    A greater count adds rows to those of a smaller one.
    """

    def begin(images: Tensor, sample: Sample) -> Tensor:
        numbers = sample(images.shape[-2])
        numbers[:, list(rows)] = -1.0  # before all others
        return numbers.argsort(dim=-1).argsort(dim=-1) < count + len(rows)

    def show(images: Tensor, memory: Tensor, blank: float) -> Tensor:
        return torch.where(memory[..., None, :, None], blank if level is None else level, images)

    return FaultModel(show, begin, hides=True)


def frozen_frames(share: float) -> FaultModel:
    """Repeat the previous image with this probability at each step."""

    def update(memory: Tensor, images: Tensor, sample: Sample) -> Tensor:
        return torch.where((sample(1)[:, 0] < share)[..., None, None, None], memory, images)

    return FaultModel(
        lambda images, memory, _: memory, lambda images, _: images, update, hides=True
    )


def held_frames(every: int) -> FaultModel:
    """Take a new image every so many steps, and repeat it until the next one."""

    def begin(images: Tensor, _: Sample) -> Tensor:
        return torch.nn.functional.pad(images.flatten(1), (0, 1))  # and its age

    def update(memory: Tensor, images: Tensor, sample: Sample) -> Tensor:
        older = torch.cat([memory[:, :-1], memory[:, -1:] + 1], 1)
        return torch.where(older[:, -1:] < every, older, begin(images, sample))

    return FaultModel(
        lambda images, memory, _: memory[:, :-1].view_as(images), begin, update, hides=True
    )


def out_of_focus(width: float) -> FaultModel:
    """Blur images by a Gaussian of this standard deviation in pixels."""
    return FaultModel(lambda images, memory, _: blur(images, width))


def late_frames(frames: int) -> FaultModel:
    """Delay images by some steps; show the episode's first image until then."""
    return FaultModel(
        lambda images, memory, _: memory[:, 0].contiguous(),
        lambda images, _: images[:, None].repeat(1, frames + 1, 1, 1, 1),
        lambda memory, images, _: torch.cat([memory[:, 1:], images[:, None]], 1),
        hides=True,
    )


def stacked_frames(
    count: int, dim: int = -3, padding: str = "same", value: float = 0.0
) -> FaultModel:
    """Concatenate the newest frames along a dimension, oldest first; TorchRL's `CatFrames`."""

    def begin(images: Tensor, _: Sample) -> Tensor:
        before = images if padding == "same" else torch.full_like(images, value)
        return torch.stack([*[before] * (count - 1), images], 1)

    return FaultModel(
        lambda images, memory, _: torch.cat(memory.unbind(1), dim),
        begin,
        lambda memory, images, _: torch.cat([memory[:, 1:], images[:, None]], 1),
    )


def random_shift(down: int, across: int) -> FaultModel:
    """Shift the images of an episode by up to so many pixels down or up, and sideways."""

    def begin(images: Tensor, sample: Sample) -> Tensor:
        most = torch.tensor([down, across], device=images.device)
        return (sample(2) * (2 * most + 1)).long() - most

    return FaultModel(lambda images, memory, _: shift(images, memory), begin)


def correlate(noise: Tensor, fresh: Tensor, correlation_time: float) -> Tensor:
    """Return the next noise of a first-order autoregressive process, AR(1), in each pixel.

    Frames that are k apart have correlation exp(-k / correlation_time); white noise at 0. `noise`,
    `fresh` and the result have mean 0 and variance 1; `fresh` is independent.
    """
    kept = math.exp(-1.0 / correlation_time) if correlation_time > 0 else 0.0
    return kept * noise + math.sqrt(1.0 - kept**2) * fresh


def blur(images: Tensor, width: float) -> Tensor:
    """Convolve with a Gaussian of this standard deviation in pixels; edges are replicated."""
    if width == 0:
        return images
    weights = gaussian(width)
    return _convolved(_convolved(images, weights, -2), weights, -1)


def gaussian(width: float) -> list[float]:
    """Return samples of a Gaussian at whole pixels up to four deviations from its centre; sum 1.

    Below a deviation of 0.6 pixels the samples have a smaller one than the Gaussian.
    """
    radius = math.ceil(4 * width)
    places = [x / width for x in range(-radius, radius + 1)]
    samples = [math.exp(-0.5 * x * x) for x in places]
    return [sample / math.fsum(samples) for sample in samples]


def _convolved(images: Tensor, weights: list[float], dim: int) -> Tensor:
    """Sum shifted images: unlike library convolutions, identical for any batch size."""
    size, radius = images.shape[dim], len(weights) // 2
    near = torch.arange(-radius, size + radius, device=images.device).clamp(0, size - 1)
    padded = images.index_select(dim, near)
    total = weights[0] * padded.narrow(dim, 0, size)
    for i, weight in enumerate(weights[1:], 1):
        total = total + weight * padded.narrow(dim, i, size)
    return total


def shift(images: Tensor, by: Tensor) -> Tensor:
    """Shift images, replicating the edges, by pixels down and to the right, (*, 2), int64."""
    for dim, far in ((-2, by[..., :1]), (-1, by[..., 1:])):
        size = images.shape[dim]
        there = torch.arange(size, device=images.device)
        rows = (there - far).clamp(0, size - 1)[..., None, :]
        rows = rows[..., None] if dim == -2 else rows[..., None, :]
        images = images.gather(dim, rows.expand(images.shape))
    return images
