"""What goes wrong in a camera during flights: what each fault draws and remembers.

Unlike the transforms in `drone_rl.envs.fault_transforms` they draw alike at every strength, so that
flights at two strengths are paired, and some of them hide things from who sees more than a picture.
"""

from collections.abc import Sequence
from typing import ClassVar, Protocol

import torch
from torch import Tensor

from drone_rl.envs import faults
from drone_rl.utils.seeding import Stream, torch_generator


class Draw(Protocol):
    """Random numbers of the worlds that still fly."""

    def __call__(self, *shape: int, normal: bool = False) -> Tensor:
        """Normal ones, or from 0 to 1. Shape: (number of worlds, *shape)."""
        ...


class Fault:
    """Something that goes wrong; by itself it changes and remembers nothing."""

    hides: ClassVar[bool] = False
    """Whether it hides what stands where, and so from an oracle, too."""

    def begin(self, pictures: Tensor, draw: Draw) -> Tensor:
        """What is remembered with the first pictures.

        Args:
            pictures: From 0 to 1. Shape: (n, C, H, W).
            draw: Random numbers.

        Returns:
            Shape: (n, *).
        """
        return pictures[:, :0]

    def go_on(self, memory: Tensor, pictures: Tensor, draw: Draw) -> Tensor:
        """The same with the next pictures."""
        return memory

    def show(self, pictures: Tensor, memory: Tensor, nothing: float) -> Tensor:
        """What is seen.

        Args:
            pictures: Shape (n, C, H, W).
            memory: With these pictures in it.
            nothing: Value of a pixel that shows nothing.
        """
        return pictures


class Noise(Fault):
    """Noise in each pixel, white or correlated in time."""

    def __init__(self, strength: float, correlation_time: float = 0.0) -> None:
        """See `drone_rl.envs.faults`."""
        self.strength, self.correlation_time = strength, correlation_time

    def begin(self, pictures: Tensor, draw: Draw) -> Tensor:
        """The noise."""
        return draw(*pictures.shape[1:], normal=True)

    def go_on(self, memory: Tensor, pictures: Tensor, draw: Draw) -> Tensor:
        """The next noise."""
        return faults.correlate(memory, self.begin(pictures, draw), self.correlation_time)

    def show(self, pictures: Tensor, memory: Tensor, nothing: float) -> Tensor:
        """Noisy pictures."""
        return faults.add_noise(pictures, self.strength, memory)


class Blur(Fault):
    """Pictures out of focus."""

    def __init__(self, width: float) -> None:
        """See `drone_rl.envs.faults`."""
        self.width = width

    def show(self, pictures: Tensor, memory: Tensor, nothing: float) -> Tensor:
        """Blurred pictures."""
        return faults.blur(pictures, self.width)


class DeadRows(Fault):
    """Rows that show nothing, the same ones for a whole flight."""

    hides = True

    def __init__(self, count: int) -> None:
        """Sets how many."""
        self.count = count

    def begin(self, pictures: Tensor, draw: Draw) -> Tensor:
        """Which rows."""
        return faults.choose_rows(draw(pictures.shape[-2]), self.count)

    def show(self, pictures: Tensor, memory: Tensor, nothing: float) -> Tensor:
        """Pictures without them."""
        return faults.kill_rows(pictures, memory, nothing)


class Frozen(Fault):
    """The picture before, shown again, by chance."""

    hides = True

    def __init__(self, share: float) -> None:
        """Sets the share of pictures that are not shown."""
        self.share = share

    def begin(self, pictures: Tensor, draw: Draw) -> Tensor:
        """What is shown."""
        draw(1)
        return pictures

    def go_on(self, memory: Tensor, pictures: Tensor, draw: Draw) -> Tensor:
        """What is shown next."""
        return faults.freeze(pictures, memory, draw(1)[:, 0] < self.share)

    def show(self, pictures: Tensor, memory: Tensor, nothing: float) -> Tensor:
        """What is remembered."""
        return memory


class Late(Fault):
    """Pictures that come late; the first one until then."""

    hides = True

    def __init__(self, frames: int) -> None:
        """Sets by how many."""
        self.frames = frames

    def begin(self, pictures: Tensor, draw: Draw) -> Tensor:
        """The pictures that are under way, oldest first."""
        return torch.stack([pictures] * (self.frames + 1), 1)

    def go_on(self, memory: Tensor, pictures: Tensor, draw: Draw) -> Tensor:
        """One more, one less."""
        return torch.cat([memory[:, 1:], pictures[:, None]], 1)

    def show(self, pictures: Tensor, memory: Tensor, nothing: float) -> Tensor:
        """The oldest."""
        return memory[:, 0]


class FaultPipeline:
    """Faults at work in many worlds at once, of which fewer and fewer still fly."""

    def __init__(
        self, faults: Sequence[Fault], num_worlds: int, seed: int, *, hiding_only: bool = False
    ) -> None:
        """Begins with no picture seen.

        Args:
            faults: In the order in which they act; each draws from a stream of its own.
            num_worlds: How many there are in all.
            seed: Of the streams.
            hiding_only: Whether to leave out those that hide nothing.
        """
        self._num_worlds = num_worlds
        self._at_work = [
            (fault, torch_generator(seed, Stream.SHIFTS, number=1 + i))
            for i, fault in enumerate(faults)
            if fault.hides or not hiding_only
        ]
        self._memories: dict[int, Tensor] = {}

    def __call__(self, pictures: Tensor, flying: Tensor, nothing: float = 0.0) -> Tensor:
        """What is seen.

        Args:
            pictures: Of the worlds that fly, from 0 to 1. Shape: (n, C, H, W).
            flying: Which these are. Shape: (n,).
            nothing: See `Fault.show`.
        """
        for i, (fault, generator) in enumerate(self._at_work):
            draw = self._draws(generator, flying)
            if i not in self._memories:
                rows = fault.begin(pictures, draw)
                self._memories[i] = rows.new_zeros(self._num_worlds, *rows.shape[1:])
            else:
                rows = fault.go_on(self._memories[i][flying], pictures, draw)
            self._memories[i][flying] = rows
            pictures = fault.show(pictures, rows, nothing)
        return pictures

    def _draws(self, generator: torch.Generator, flying: Tensor) -> Draw:
        def draw(*shape: int, normal: bool = False) -> Tensor:
            make = torch.randn if normal else torch.rand
            every = make(self._num_worlds, *shape, generator=generator)
            return every.to(flying.device)[flying]

        return draw
