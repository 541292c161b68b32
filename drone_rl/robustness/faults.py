"""Camera faults of the robustness evaluation.

Unlike the transforms in `drone_rl.envs.fault_transforms` they sample the same random numbers at
every strength, so that episodes at two strengths are paired.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Protocol

import torch
from torch import Tensor

from drone_rl.envs import faults as camera
from drone_rl.utils.seeding import Stream, torch_generator


class Sample(Protocol):
    """Random numbers of the active environments."""

    def __call__(self, *shape: int, normal: bool = False) -> Tensor:
        """Sample normal numbers, or from 0 to 1. Shape: (number of environments, *shape)."""
        ...


def _no_memory(images: Tensor, sample: Sample) -> Tensor:
    return images[:, :0]


def _keep(memory: Tensor, images: Tensor, sample: Sample) -> Tensor:
    return memory


@dataclasses.dataclass(frozen=True)
class Fault:
    """A camera fault; images are floats from 0 to 1 of shape (n, C, H, W)."""

    show: Callable[[Tensor, Tensor, float], Tensor] = lambda images, memory, nothing: images
    """The faulty images, from images, memory and the value of a pixel that shows nothing."""
    begin: Callable[[Tensor, Sample], Tensor] = _no_memory
    """The memory at the first images. Shape: (n, *)."""
    update: Callable[[Tensor, Tensor, Sample], Tensor] = _keep
    """The memory at the next images."""
    hides: bool = False
    """Whether it can hide objects, and so affects an oracle."""


def noise(strength: float, correlation_time: float = 0.0) -> Fault:
    """Noise in each pixel, white or correlated in time; see `drone_rl.envs.faults`."""

    def begin(images: Tensor, sample: Sample) -> Tensor:
        return sample(*images.shape[1:], normal=True)

    def update(memory: Tensor, images: Tensor, sample: Sample) -> Tensor:
        return camera.correlate(memory, begin(images, sample), correlation_time)

    return Fault(
        lambda images, memory, _: camera.add_noise(images, strength, memory), begin, update
    )


def blur(width: float) -> Fault:
    """Images out of focus, by a Gaussian of this width in pixels."""
    return Fault(lambda images, memory, _: camera.blur(images, width))


def dead_rows(count: int) -> Fault:
    """Rows that show nothing, the same ones for a whole episode."""

    def begin(images: Tensor, sample: Sample) -> Tensor:
        return camera.choose_rows(sample(images.shape[-2]), count)

    return Fault(camera.kill_rows, begin, hides=True)


def frozen_frames(rate: float) -> Fault:
    """The previous image shown again, with this probability at each step."""

    def begin(images: Tensor, sample: Sample) -> Tensor:
        sample(1)
        return images

    def update(memory: Tensor, images: Tensor, sample: Sample) -> Tensor:
        return camera.freeze(images, memory, sample(1)[:, 0] < rate)

    return Fault(lambda images, memory, _: memory, begin, update, hides=True)


def late_frames(frames: int) -> Fault:
    """Images that arrive this many steps late; the first one until then."""
    return Fault(
        lambda images, memory, _: memory[:, 0],
        lambda images, _: torch.stack([images] * (frames + 1), 1),
        lambda memory, images, _: torch.cat([memory[:, 1:], images[:, None]], 1),
        hides=True,
    )


class FaultPipeline:
    """Applies faults in a batch of environments, of which fewer and fewer are active."""

    def __init__(
        self, faults: Sequence[Fault], num_worlds: int, seed: int, *, hiding_only: bool = False
    ) -> None:
        """Take the faults.

        Args:
            faults: In the order in which they act; each has a random stream of its own.
            num_worlds: Number of environments in all.
            seed: Root of the streams.
            hiding_only: Whether to leave out faults that hide nothing.
        """
        self._num_worlds = num_worlds
        self._faults = [
            (fault, torch_generator(seed, Stream.SHIFTS, number=1 + i))
            for i, fault in enumerate(faults)
            if fault.hides or not hiding_only
        ]
        self._memories: dict[int, Tensor] = {}

    def __call__(self, images: Tensor, active: Tensor, nothing: float = 0.0) -> Tensor:
        """Return the faulty images of one step.

        Args:
            images: Of the active environments, from 0 to 1. Shape: (n, C, H, W).
            active: Indices of these. Shape: (n,).
            nothing: Value of a pixel that shows nothing.
        """
        for i, (fault, generator) in enumerate(self._faults):
            sample = self._sampler(generator, active)
            if i not in self._memories:
                rows = fault.begin(images, sample)
                self._memories[i] = rows.new_zeros(self._num_worlds, *rows.shape[1:])
            else:
                rows = fault.update(self._memories[i][active], images, sample)
            self._memories[i][active] = rows
            images = fault.show(images, rows, nothing)
        return images

    def _sampler(self, generator: torch.Generator, active: Tensor) -> Sample:
        def sample(*shape: int, normal: bool = False) -> Tensor:
            draw = torch.randn if normal else torch.rand
            every = draw(self._num_worlds, *shape, generator=generator)
            return every.to(active.device)[active]

        return sample
