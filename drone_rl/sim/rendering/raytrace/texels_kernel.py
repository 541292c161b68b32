"""Textures with mip levels, flat ones and cube maps, sampled as OpenGL does."""

import warp as wp

from drone_rl.sim.rendering.raytrace.structs_kernel import struct

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@struct
class Textures:
    """Textures one after the other, each with its mip levels, the finest first."""

    width: wp.array[int]
    height: wp.array[int]
    faces: wp.array[int]
    """Images of each level: 6 of a cube map, 1 of a flat texture."""
    start: wp.array[int]
    """First texel of each texture."""
    texels: wp.array[wp.uint32]
    """Red in the lowest 8 bits, then green, then blue."""


@wp.func
def sample_flat(
    textures: Textures, texture: int, here: wp.vec3, right: wp.vec3, below: wp.vec3
) -> wp.vec3:
    """Return the color, 0 to 1, at coordinates in a texture that repeats.

    `right` and `below` are the steps to the coordinates of the next pixels.
    """
    width, height = float(textures.width[texture]), float(textures.height[texture])
    one = wp.vec2(right[0] * width, right[1] * height)
    two = wp.vec2(below[0] * width, below[1] * height)
    most = wp.max(wp.length_sq(one), wp.length_sq(two))
    return _sample_levels(textures, texture, 0, here[0], here[1], wp.sqrt(most))


@wp.func
def sample_cube(
    textures: Textures, texture: int, ray: wp.vec3, right: wp.vec3, below: wp.vec3
) -> wp.vec3:
    """Return the color, 0 to 1, of a cube map in a direction.

    `right` and `below` are the steps to the directions of the next pixels.
    """
    axis = int(wp.argmax(wp.vec3(wp.abs(ray[0]), wp.abs(ray[1]), wp.abs(ray[2]))))
    face = 2 * axis
    if ray[axis] < 0.0:
        face += 1
    here = _on_face(face, axis, ray)
    one, two = _on_face(face, axis, ray + right) - here, _on_face(face, axis, ray + below) - here
    most = wp.sqrt(wp.max(wp.length_sq(one), wp.length_sq(two)))
    most *= float(textures.width[texture])
    return _sample_levels(textures, texture, face, here[0], here[1], most)


@wp.func
def _on_face(face: int, axis: int, ray: wp.vec3) -> wp.vec2:
    """Return coordinates on a face of a cube map (OpenGL 4.6, table 8.19)."""
    across, down = ray[0], -ray[1]
    if face == 0:
        across = -ray[2]
    if face == 1:
        across = ray[2]
    if face == 2:
        down = ray[2]
    if face == 3:
        down = -ray[2]
    if face == 5:
        across = -ray[0]
    most = wp.max(wp.abs(ray[axis]), 1e-9)
    return wp.vec2(0.5 + 0.5 * across / most, 0.5 + 0.5 * down / most)


@wp.func
def _sample_levels(
    textures: Textures, texture: int, face: int, across: float, down: float, texels: float
) -> wp.vec3:
    """Interpolate between texels and between mip levels; a pixel is `texels` wide."""
    width, height = int(textures.width[texture]), int(textures.height[texture])
    faces, start = int(textures.faces[texture]), int(textures.start[texture])
    covered = float(texels)
    while covered >= 2.0 and (width > 1 or height > 1):
        start += width * height * faces
        width = wp.max(width // 2, 1)
        height = wp.max(height // 2, 1)
        covered *= 0.5
    first = start + face * width * height
    color = _sample_level(textures.texels, first, width, height, faces > 1, across, down)
    if covered > 1.0 and (width > 1 or height > 1):
        start += width * height * faces
        width = wp.max(width // 2, 1)
        height = wp.max(height // 2, 1)
        first = start + face * width * height
        coarse = _sample_level(textures.texels, first, width, height, faces > 1, across, down)
        color += (covered - 1.0) * (coarse - color)
    return color / 255.0


@wp.func
def _sample_level(
    texels: wp.array[wp.uint32],
    start: int,
    width: int,
    height: int,
    is_cube: bool,
    across: float,
    down: float,
) -> wp.vec3:
    x, y = across * float(width) - 0.5, down * float(height) - 0.5
    left, upper = wp.floor(x), wp.floor(y)
    share_x, share_y = x - left, y - upper
    above = start + _wrap(int(upper), height, is_cube) * width
    below = start + _wrap(int(upper) + 1, height, is_cube) * width
    one, two = _wrap(int(left), width, is_cube), _wrap(int(left) + 1, width, is_cube)
    first = _color(texels[above + one]) * (1.0 - share_x) + _color(texels[above + two]) * share_x
    second = _color(texels[below + one]) * (1.0 - share_x) + _color(texels[below + two]) * share_x
    return first * (1.0 - share_y) + second * share_y


@wp.func
def _wrap(number: int, count: int, is_cube: bool) -> int:
    """Repeat a texture; clamp at the edges of a cube map's faces."""
    if is_cube:
        return wp.clamp(number, 0, count - 1)
    rest = number % count
    if rest < 0:
        rest += count
    return rest


@wp.func
def _color(texel: wp.uint32) -> wp.vec3:
    return wp.vec3(
        float(texel & wp.uint32(255)),
        float((texel >> wp.uint32(8)) & wp.uint32(255)),
        float((texel >> wp.uint32(16)) & wp.uint32(255)),
    )
