"""A camera that is mounted elsewhere on the drone, turned there, or sees more or less."""

import dataclasses
import math

import torch
from torch import Tensor

AXES = {"roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
"""What a camera turns around, drone frame: x forward, y left, z up."""
_LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Mounting:
    """How one camera differs from the model's; each value is one for all worlds or one for each."""

    camera: str = "drone/front_center"
    """Its full name in the model; all others stay as they are."""
    offset: tuple[float, ...] | Tensor = (0.0, 0.0, 0.0)
    """Metres, drone frame. Shape: (3,) or (num_worlds, 3)."""
    turn: tuple[float, ...] | Tensor = _LEVEL
    """About its own place, drone frame, a quaternion (w, x, y, z). Shape: (4,) or
    (num_worlds, 4)."""
    zoom: float | Tensor | None = None
    """How many times as large things look in the middle of the picture. Shape: () or
    (num_worlds,)."""


def moved(mounting: Mounting | None, offset: Tensor, turn: Tensor) -> Mounting:
    """A camera that is moved, then turned about itself, both in the frame that it had before.

    Args:
        mounting: How it was mounted; as in the model by default.
        offset: Metres. Shape: (num_worlds, 3).
        turn: Quaternions. Shape: (num_worlds, 4).
    """
    own = mounting or Mounting()
    before = torch.as_tensor(own.turn, dtype=offset.dtype).to(offset.device)
    there = torch.as_tensor(own.offset, dtype=offset.dtype).to(offset.device)
    return dataclasses.replace(
        own, offset=there + rotate(before, offset), turn=product(before, turn)
    )


def turned(axis: str, degrees: float | Tensor) -> Tensor:
    """Quaternions of turns around one of `AXES`. Shape: (*, 4) of degrees of shape (*)."""
    half = torch.deg2rad(torch.as_tensor(degrees, dtype=torch.float64)) / 2
    around = half.new_tensor(AXES[axis])
    return torch.cat([half.cos()[..., None], half.sin()[..., None] * around], -1)


def zoom_of(own: float, wanted: Tensor) -> Tensor:
    """How much larger things look by another field of view.

    Args:
        own: Degrees.
        wanted: Degrees. Shape: (*).
    """
    return math.tan(math.radians(own) / 2) / torch.tan(torch.deg2rad(wanted) / 2)


def product(a: Tensor, b: Tensor) -> Tensor:
    """Quaternions (w, x, y, z) one after the other: b in the frame that a makes. Shapes: (*, 4)."""
    a, b = torch.broadcast_tensors(a, b)
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(-1, keepdim=True)
    cross = torch.linalg.cross(a[..., 1:], b[..., 1:])
    return torch.cat([scalar, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + cross], -1)


def rotate(attitude: Tensor, vector: Tensor) -> Tensor:
    """A vector in the frame in which an attitude is given. Shapes: (*, 4) and (*, 3)."""
    axis, vector = torch.broadcast_tensors(attitude[..., 1:], vector)
    twice = 2 * torch.linalg.cross(axis, vector)
    return vector + attitude[..., :1] * twice + torch.linalg.cross(axis, twice)
