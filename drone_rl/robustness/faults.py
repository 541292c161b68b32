"""Camera faults of the robustness evaluation.

Unlike the transforms in `drone_rl.envs.camera_faults` they sample the same random numbers at
every strength, so that episodes at two strengths are paired.
"""

import dataclasses
from collections.abc import Sequence

import torch
from torch import Tensor

from drone_rl.envs import fault_models
from drone_rl.envs.fault_models import FaultModel, Sample
from drone_rl.utils.seeding import Stream, torch_generator


def frozen_frames(rate: float) -> FaultModel:
    """The previous image shown again, with this probability at each step."""

    def begin(images: Tensor, sample: Sample) -> Tensor:
        sample(1)  # one number a step, the first included
        return images

    return dataclasses.replace(fault_models.frozen_frames(rate), begin=begin)


class FaultPipeline:
    """Applies faults in a batch of environments, of which fewer and fewer are active."""

    def __init__(
        self, faults: Sequence[FaultModel], num_worlds: int, seed: int, *, hiding_only: bool = False
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
