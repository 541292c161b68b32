"""Textures of a scene, with their mip levels, for `texels_kernel`."""

from collections.abc import Sequence
from typing import Any

import mujoco as _mujoco
import numpy as np
import warp as wp
from numpy.typing import NDArray

from drone_rl.sim.rendering import textures
from drone_rl.sim.rendering.raytrace.texels_kernel import Textures
from drone_rl.sim.rendering.scene import Scene

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_SHIFTS = np.array([1, 1 << 8, 1 << 16], np.uint32)
"""Of red, green and blue bytes in one number."""
_BYTES = np.arange(256) / 255.0
_LINEAR = np.round(
    255 * np.where(_BYTES <= 0.04045, _BYTES / 12.92, ((_BYTES + 0.055) / 1.055) ** 2.4)
).astype(np.uint8)
"""Linear brightness of the bytes of sRGB images."""


def make_textures(scene: Scene, more: Sequence[str] = ()) -> Textures:
    """Return the textures of a scene, then some by name or file, with their mip levels."""
    model = scene.model
    texels, starts, faces, total = [np.zeros((1, 3), np.uint8)], [], [], 1
    widths, heights = [], []
    every = [_images(model, number) for number in range(model.ntex)]
    for images in every + [textures.load(name)[None] for name in more]:
        rows = [level.reshape(-1, 3) for level in _levels(images)]
        heights.append(images.shape[1])
        widths.append(images.shape[2])
        starts.append(total)
        faces.append(len(images))
        texels += rows
        total += sum(map(len, rows))
    made: Any = Textures()
    values = {
        "width": (widths, int),
        "height": (heights, int),
        "faces": (faces, int),
        "start": (starts, int),
        "texels": (np.concatenate(texels).astype(np.uint32) @ _SHIFTS, wp.uint32),
    }
    for name, (value, dtype) in values.items():
        setattr(made, name, wp.array(np.array(value), dtype=dtype, device="cpu"))
    return made


def _images(model: Any, number: int) -> NDArray:
    """Return the image of a texture, or the six of a cube map. Shape: (faces, height, width, 3)."""
    channels, width = model.tex_nchannel[number], model.tex_width[number]
    height, first = model.tex_height[number], model.tex_adr[number]
    data = model.tex_data[first : first + width * height * channels]
    if channels < 3:
        return np.full((1, 1, 1, 3), 255, np.uint8)
    image = data.reshape(height, width, channels)[..., :3]
    if model.tex_colorspace[number] == mujoco.mjtColorSpace.mjCOLORSPACE_SRGB:
        image = _LINEAR[image]
    if model.tex_type[number] == mujoco.mjtTexture.mjTEXTURE_2D:
        return image[None]
    return np.repeat(image[None], 6, 0) if width == height else image.reshape(6, width, width, 3)


def _levels(images: NDArray) -> list[NDArray]:
    """Return images and their mip levels, finest first."""
    levels = [images]
    while max(levels[-1].shape[1:3]) > 1:
        levels.append(_halved(_halved(levels[-1], 1), 2))
    return levels


def _halved(images: NDArray, axis: int) -> NDArray:
    """Halve a side, rounded down, by linear interpolation as OpenGL does."""
    side = images.shape[axis]
    half = max(1, side // 2)
    at = (np.arange(half) + 0.5) * side / half - 0.5
    low = at.astype(int)
    share = (at - low).reshape([-1 if i == axis else 1 for i in range(4)])
    one, two = (images.take(np.minimum(i, side - 1), axis) for i in (low, low + 1))
    return np.round(one + share * (two.astype(float) - one)).astype(np.uint8)
