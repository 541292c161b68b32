"""What is different from how a policy was trained: the task, the camera, the look, the pictures."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Protocol, Self

from torch import Tensor

from drone_rl.robustness.faults import Fault
from drone_rl.robustness.mounting import Mount
from drone_rl.sim.rendering import Appearance


class Look(Protocol):
    """Makes worlds look otherwise than they did, each in a way of its own."""

    @property
    def dimensions(self) -> int:
        """How many numbers say in which way, each from -1 to 1."""
        ...

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """The look.

        Args:
            appearance: Before; all of it is given.
            sway: In which way. Shape: (num_worlds, dimensions), float64.
        """
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class Condition:
    """All that is different at once; nothing by default."""

    task: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Settings of the task that have other values."""
    camera: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """The same of the camera."""
    looks: tuple[Look, ...] = ()
    mounts: tuple[Mount, ...] = ()
    """How the camera is mounted otherwise."""
    faults: tuple[Fault, ...] = ()
    """What becomes of pictures once they are taken, in order."""
    delay: int = 0
    """Steps by which actions come late."""
    clutter: int = 0
    """Distractors beside the way."""

    @property
    def dimensions(self) -> tuple[int, ...]:
        """Of the looks, then of the mounts: numbers from -1 to 1 that tell worlds apart."""
        return tuple(part.dimensions for part in (*self.looks, *self.mounts))

    def __or__(self, other: Self) -> "Condition":
        """Both at once; of what both set, the other one's value."""
        return Condition(
            task={**self.task, **other.task},
            camera={**self.camera, **other.camera},
            looks=self.looks + other.looks,
            mounts=self.mounts + other.mounts,
            faults=self.faults + other.faults,
            delay=max(self.delay, other.delay),
            clutter=max(self.clutter, other.clutter),
        )
