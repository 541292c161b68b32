"""Where a drone is, how it is turned, and how fast it moves and turns."""

import dataclasses
from typing import Self

import torch
from torch import Tensor

from drone_rl.utils.batch import Batch

LEVEL = (1.0, 0.0, 0.0, 0.0)
"""The attitude of a drone that is level and looks forward, quaternion (w, x, y, z)."""


def heading_only(attitude: Tensor) -> Tensor:
    """Attitudes without their tilt: the turns about the world's z axis that are nearest to them.

    Args:
        attitude: Unit quaternions (w, x, y, z). Shape: (*, 4).

    Returns:
        The same shape; level and looking forward for a drone upside down, which has no heading.
    """
    w, z = attitude[..., 0], attitude[..., 3]
    length = (w * w + z * z).sqrt()
    zero, has_one = torch.zeros_like(length), length > 0.0
    w, z = torch.where(has_one, w / length, 1.0), torch.where(has_one, z / length, 0.0)
    return torch.stack([w, zero, zero, z], -1)


def heading_of(attitude: Tensor) -> Tensor:
    """Where drones look, radians to the left of the world's x.

    Args:
        attitude: Unit quaternions (w, x, y, z). Shape: (*, 4).
    """
    w, x, y, z = attitude.unbind(-1)
    return torch.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@dataclasses.dataclass
class BodyState(Batch):
    """The bodies of `num_worlds` drones. World frame (x forward, y left, z up), SI units."""

    position: Tensor  # (num_worlds, 3) float64
    """Metres."""
    attitude: Tensor  # (num_worlds, 4) float64
    """Unit quaternion (w, x, y, z) that turns the body's frame into the world's."""
    velocity: Tensor  # (num_worlds, 3) float64
    """Metres a second."""
    angular_velocity: Tensor  # (num_worlds, 3) float64
    """Radians a second; of drones in flight about the body's axes."""

    @property
    def is_lost(self) -> Tensor:
        """Whether a drone's motion has diverged, so that there is nothing more to say of it.

        Shape: (num_worlds,), bool.
        """
        return torch.zeros(len(self.position), dtype=torch.bool, device=self.position.device)

    def moved(self, position: Tensor, attitude: Tensor | None = None) -> Self:
        """The same elsewhere.

        Args:
            position: Metres. Shape: (num_worlds, 3), float64.
            attitude: As it is by default. Shape: (num_worlds, 4), float64.
        """
        attitude = self.attitude if attitude is None else attitude
        return dataclasses.replace(self, position=position, attitude=attitude)

    @classmethod
    def at_rest(cls, position: Tensor, attitude: Tensor | None = None) -> Self:
        """Bodies that don't move.

        Args:
            position: Metres. Shape: (num_worlds, 3), float64.
            attitude: Level by default. Shape: (num_worlds, 4), float64.
        """
        if attitude is None:
            attitude = position.new_tensor(LEVEL).repeat(len(position), 1)
        still = torch.zeros_like(position)
        return cls(position, attitude, still, still.clone())
