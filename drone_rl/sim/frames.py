"""Between our frames and those of others: NED, ENU, and bodies whose z points down.

Ours are x forward, y left, z up, for the world and for bodies alike; the world's forward is north.
NED is north, east, down, with bodies forward, right, down (FRD): AirSim's and PX4's. ENU is east,
north, up, with bodies like ours (FLU): that of ROS. Quaternions are (w, x, y, z), turn the body's
frame into the world's, and have length 1. Tensors give tensors, NumPy's arrays give arrays; all
functions take any number of them at once, the last dimension being that of the vector.
"""

import math
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering.appearance import rotate

Values = TypeVar("Values", Tensor, NDArray[Any])
"""A tensor or an array; what comes out is of the kind that went in."""
_HALF = math.sqrt(0.5)


def ned_from_world(vector: Values) -> Values:
    """Positions, velocities or directions of our world in NED. Shape: (*, 3)."""
    return _signed(vector, (1.0, -1.0, -1.0))


def world_from_ned(vector: Values) -> Values:
    """The way back. Shape: (*, 3)."""
    return _signed(vector, (1.0, -1.0, -1.0))


def enu_from_world(vector: Values) -> Values:
    """Positions, velocities or directions of our world in ENU. Shape: (*, 3)."""
    return _signed(vector[..., [1, 0, 2]], (-1.0, 1.0, 1.0))


def world_from_enu(vector: Values) -> Values:
    """The way back. Shape: (*, 3)."""
    return _signed(vector[..., [1, 0, 2]], (1.0, -1.0, 1.0))


def frd_from_body(vector: Values) -> Values:
    """Vectors, or rates about the axes, of our body's frame in FRD. Shape: (*, 3)."""
    return _signed(vector, (1.0, -1.0, -1.0))


def body_from_frd(vector: Values) -> Values:
    """The way back. Shape: (*, 3)."""
    return _signed(vector, (1.0, -1.0, -1.0))


def ned_attitude_from_world(attitude: Values) -> Values:
    """Attitudes of our bodies in our world as those of FRD bodies in NED. Shape: (*, 4)."""
    return _signed(attitude, (1.0, 1.0, -1.0, -1.0))


def world_attitude_from_ned(attitude: Values) -> Values:
    """The way back. Shape: (*, 4)."""
    return _signed(attitude, (1.0, 1.0, -1.0, -1.0))


def enu_attitude_from_world(attitude: Values) -> Values:
    """Attitudes of our bodies in our world as those of the same bodies in ENU. Shape: (*, 4).

    A quarter turn to the left comes before: who looks north has his x along ENU's y.
    """
    mixed = _signed(attitude[..., [3, 2, 1, 0]], (-1.0, -1.0, 1.0, 1.0))
    return _HALF * (attitude + mixed)


def world_attitude_from_enu(attitude: Values) -> Values:
    """The way back. Shape: (*, 4)."""
    mixed = _signed(attitude[..., [3, 2, 1, 0]], (1.0, 1.0, -1.0, -1.0))
    return _HALF * (attitude + mixed)


def heading_from_yaw(yaw: Values) -> Values:
    """Degrees clockwise from north, as seen from above, in (-180, 180], of our yaw.

    Args:
        yaw: Radians to the left of forward. Shape: (*).
    """
    return 180.0 - (180.0 / math.pi * yaw + 180.0) % 360.0


def yaw_from_heading(heading: Values) -> Values:
    """Radians to the left of forward, in [-pi, pi), of a heading.

    Args:
        heading: Degrees clockwise from north. Shape: (*).
    """
    return (math.pi - math.pi / 180.0 * heading) % (2 * math.pi) - math.pi


def enu_yaw_from_yaw(yaw: Values) -> Values:
    """Radians to the left of east, in [-pi, pi), of our yaw. Shape: (*)."""
    return (yaw + 1.5 * math.pi) % (2 * math.pi) - math.pi


def yaw_from_enu_yaw(yaw: Values) -> Values:
    """The way back, in [-pi, pi). Shape: (*)."""
    return (yaw + 0.5 * math.pi) % (2 * math.pi) - math.pi


def body_from_world(attitude: Tensor, vector: Tensor) -> Tensor:
    """Vectors of our world's frame along the axes of bodies.

    Args:
        attitude: Of the bodies. Shape: (*, 4).
        vector: Shape: (*, 3).
    """
    return rotate(_signed(attitude, (1.0, -1.0, -1.0, -1.0)), vector)


def world_from_body(attitude: Tensor, vector: Tensor) -> Tensor:
    """The way back. Shapes: (*, 4) and (*, 3)."""
    return rotate(attitude, vector)


def _signed(values: Values, signs: tuple[float, ...]) -> Values:
    if isinstance(values, Tensor):
        return values * torch.tensor(signs, dtype=values.dtype, device=values.device)
    return values * np.array(signs, dtype=values.dtype)
