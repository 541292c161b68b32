"""Pictures for MuJoCo's OpenGL: the six sides of a sky, and of boxes that a texture covers.

A cube's sides come in the order +x, -x, +y, -y, +z, -z, each a picture whose rows and columns run
as OpenGL has it for cube maps.
"""

import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.rendering import textures

_RIGHT = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]])
_DOWN = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]])
_OUT = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_LAID = ((1, 2), (0, 2), (0, 1))
"""By the axis that a side looks along: the coordinates that a texture follows to the right, and
upwards."""


def sky_sides(side: int, horizon: NDArray, zenith: NDArray) -> NDArray[np.uint8]:
    """A sky that goes from one colour to the other with the sine of the elevation; +y is up.

    Args:
        side: Texels each way.
        horizon: Colour there and below, from 0 to 1. Shape: (3,).
        zenith: Colour overhead. Shape: (3,).

    Returns:
        Shape: (6, side, side, 3).
    """
    points = _points(side)
    up = np.clip(points[..., 1:2] / np.linalg.norm(points, axis=-1, keepdims=True), 0.0, 1.0)
    return _bytes(horizon + up * (zenith - horizon))


def box_sides(side: int, picture: NDArray[np.uint8], half: NDArray, tile: float) -> NDArray:
    """What covers a box: tiles that begin in the middle of each side, as our ray tracer lays them.

    Args:
        side: Texels each way.
        picture: The texture. Shape: (texels, texels, 3), a power of 2 of them.
        half: Half extents of the box, metres. Shape: (3,).
        tile: Edge of a tile, metres.

    Returns:
        Shape: (6, side, side, 3), uint8.
    """
    points = _points(side) * half
    sides = []
    for number, at in enumerate(points):
        across, upward = _LAID[number // 2]
        level = _fitting(picture, 2 * max(half[across], half[upward]) / side / tile)
        count = len(level)
        column = np.floor(at[..., across] / tile * count).astype(int) % count
        row = np.floor(-at[..., upward] / tile * count).astype(int) % count
        sides.append(level[row, column])
    return np.stack(sides)


def flat(picture: NDArray[np.uint8] | None, side: int) -> NDArray[np.uint8]:
    """A texture at another size; white without one. Shape: (side, side, 3)."""
    if picture is None:
        return np.full((side, side, 3), 255, np.uint8)
    at = np.arange(side) * len(picture) // side
    return picture[at[:, None], at[None, :]]


def _points(side: int) -> NDArray[np.float64]:
    """Where texels are on a cube from -1 to 1. Shape: (6, side, side, 3)."""
    at = (np.arange(side) + 0.5) / side * 2 - 1
    across, down = at[None, None, :, None], at[None, :, None, None]
    return _OUT[:, None, None] + across * _RIGHT[:, None, None] + down * _DOWN[:, None, None]


def _fitting(picture: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
    """The mip level whose texels are as large as so large a share of a tile, or finer."""
    rows, side = textures.levels(picture), len(picture)
    start = 0
    while side > 1 and 2.0 / side <= share:
        start, side = start + side * side, side // 2
    return rows[start : start + side * side].reshape(side, side, 3)


def _bytes(colors: NDArray) -> NDArray[np.uint8]:
    return np.clip(np.round(colors * 255.0), 0, 255).astype(np.uint8)
