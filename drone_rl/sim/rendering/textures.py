"""Texture images: procedural ones, which are gray, and the user's PNG or JPEG files."""

import functools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drone_rl.utils.errors import InputError

MAX_PIXELS = 4096
"""Of an image, each way."""
_FORMATS = ("PNG", "JPEG")
_SIDE = 256
"""Texels of procedural textures, each way."""


def checker() -> NDArray[np.float64]:
    """Return two light and two dark squares."""
    half = np.arange(_SIDE) < _SIDE // 2
    return np.where(half[:, None] == half[None, :], 1.0, 0.55)


def grid() -> NDArray[np.float64]:
    """Return thick grid lines around 4 x 4 cells with thin ones."""
    at = np.arange(_SIDE)
    frame = np.minimum(at, _SIDE - 1 - at) < _SIDE // 64
    fine = np.minimum(at % 64, 63 - at % 64) < 1
    lines = np.where(frame, 0.45, np.where(fine, 0.8, 1.0))
    return np.minimum(lines[:, None], lines[None, :])


def bricks() -> NDArray[np.float64]:
    """Return eight courses of four bricks, each with its own brightness."""
    rows, columns = np.mgrid[:_SIDE, :_SIDE]
    course = rows // 32
    shifted = (columns + 32 * (course % 2)) % _SIDE
    bright = np.random.RandomState(0).uniform(0.75, 1.0, (8, 4))[course, shifted // 64]
    is_joint = (rows % 32 < 3) | (shifted % 64 < 3)
    return np.where(is_joint, 0.55, bright)


def noise() -> NDArray[np.float64]:
    """Return uneven ground: smooth noise at seven scales."""
    source, spots = np.random.RandomState(0), np.zeros((_SIDE, _SIDE))
    for size in (4, 8, 16, 32, 64, 128, 256):
        spots += _stretched(source.uniform(-1.0, 1.0, (size, size))) / size**0.5
    return np.clip(0.78 + 0.22 * spots / spots.std() / 2, 0.0, 1.0)


PROCEDURAL: dict[str, Callable[[], NDArray[np.float64]]] = {
    texture.__name__: texture for texture in (checker, grid, bricks, noise)
}
"""Textures by name. Values: in [0, 1], shape (side, side)."""


@functools.cache
def load(name: str) -> NDArray[np.uint8]:
    """Load a texture: red, green, blue, shape (side, side, 3), the side a power of 2.

    `name` is one of `PROCEDURAL`, or a PNG or JPEG file, which is stretched to a square. Raises an
    `InputError` if the file does not exist, is not an image, or is too large.
    """
    if name in PROCEDURAL:
        gray = np.round(PROCEDURAL[name]() * 255.0).astype(np.uint8)
        return np.repeat(gray[..., None], 3, -1)
    try:
        path = Path(name).expanduser()
        if not path.is_file():
            raise FileNotFoundError(path)
        with Image.open(path, formats=_FORMATS) as image:
            width, height = image.size
            is_small = max(width, height) <= MAX_PIXELS
            side = 2 ** math.ceil(math.log2(max(width, height)))
            square = image.convert("RGB").resize((side, side)) if is_small else None
    except (OSError, RuntimeError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(
            f"texture={name!r} can't be read as an image; give a PNG or JPEG file, or one of: "
            f"{', '.join(PROCEDURAL)}"
        ) from error
    if square is None:
        raise InputError(
            f"texture={name!r} has {width}x{height} pixels; give an image of at most "
            f"{MAX_PIXELS} each way"
        )
    return np.asarray(square)


def levels(texture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the texels of a texture and its mip levels, finest first. Shape: (num_texels, 3)."""
    level, rows = texture.astype(np.float32), [texture.reshape(-1, 3)]
    while len(level) > 1:
        half = len(level) // 2
        level = level.reshape(half, 2, half, 2, 3).mean((1, 3))
        rows.append(np.round(level).astype(np.uint8).reshape(-1, 3))
    return np.concatenate(rows)


def _stretched(spots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate noise to the full size, periodic at the edges."""
    at = np.arange(_SIDE) * len(spots) / _SIDE
    first, share = at.astype(int), at % 1.0
    share = share * share * (3.0 - 2.0 * share)
    after = (first + 1) % len(spots)
    rows = spots[first] * (1 - share)[:, None] + spots[after] * share[:, None]
    return rows[:, first] * (1 - share) + rows[:, after] * share
