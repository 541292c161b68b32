"""The camera mounted elsewhere on the drone, or turned there.

Of the drone itself its camera sees nothing. So a camera that is mounted otherwise sees what the
drone's own camera sees of a drone that stands elsewhere: only that one is drawn so.
"""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.sim.entities.cameras import FRONT_CENTER
from drone_rl.sim.rendering import Poses

AXES = {"roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
"""What the camera turns around, drone frame: x forward, y left, z up."""


@dataclasses.dataclass(frozen=True)
class Mount:
    """A camera that is moved, and turned about itself."""

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Metres, drone frame: forward, to the left, up."""
    turn: str = "yaw"
    """Around which of `AXES`."""
    degrees: float = 0.0
    dimensions: int = 1
    """One number: 1 as stated, -1 the opposite way."""

    def __call__(self, poses: Poses, sway: Tensor) -> Poses:
        """Where drones would stand whose own cameras see what these ones see.

        Args:
            poses: Where they stand.
            sway: How much of it, from -1 to 1. Shape: (num_worlds, 1).
        """
        position, attitude = poses.position, poses.attitude
        camera, offset = position.new_tensor(FRONT_CENTER.pos), position.new_tensor(self.offset)
        half = torch.as_tensor(sway, dtype=attitude.dtype) * math.radians(self.degrees) / 2
        turned = torch.cat([half.cos(), half.sin() * attitude.new_tensor(AXES[self.turn])], -1)
        whole = product(attitude, turned)
        there = position + rotate(attitude, camera + sway * offset) - rotate(whole, camera)
        return dataclasses.replace(poses, position=there, attitude=whole)


def product(a: Tensor, b: Tensor) -> Tensor:
    """Quaternions (w, x, y, z) one after the other: b in the frame that a makes. Shapes: (*, 4)."""
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(-1, keepdim=True)
    cross = torch.linalg.cross(a[..., 1:], b[..., 1:])
    return torch.cat([scalar, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + cross], -1)


def rotate(attitude: Tensor, vector: Tensor) -> Tensor:
    """A vector in the world's frame. Shapes: (*, 4) and (*, 3)."""
    axis, vector = attitude[..., 1:], vector.expand(*attitude.shape[:-1], 3)
    twice = 2 * torch.linalg.cross(axis, vector)
    return vector + attitude[..., :1] * twice + torch.linalg.cross(axis, twice)
