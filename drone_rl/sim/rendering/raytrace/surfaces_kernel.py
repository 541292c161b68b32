"""Surfaces of geoms: their materials, and where a texture lies on them in MuJoCo's OpenGL."""

import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import MESH
from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    PLANE,
    ROUND,
)
from drone_rl.sim.rendering.raytrace.structs_kernel import struct

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

WRAPPED = wp.constant(0)
"""Mapping of a texture by coordinates that go around a primitive, or by those of a mesh."""
PROJECTED = wp.constant(1)
"""By x and y in the geom's frame."""
CUBE = wp.constant(2)
"""A cube map, by direction from the geom's centre."""
TILED = wp.constant(3)
"""By metres in the geom's frame, on the side of a box with the most similar normal."""

DOME = wp.constant(0)
"""Parts of round solids: half a ball, ..."""
TUBE = wp.constant(1)
"""... the side of a cylinder, ..."""
DISK = wp.constant(2)
"""... and its ends."""
TURN = wp.constant(6.2831853)
"""Radians of a full turn."""


@struct
class Surfaces:
    """Appearance of geoms by index in the model; rows: one for all environments or one each."""

    color: wp.array2d[wp.vec4]
    """Red, green, blue, opacity, 0 to 1."""
    shine: wp.array[wp.vec3]
    """Emission, specular factor and exponent of the highlight."""
    texture: wp.array2d[int]
    """-1 for none."""
    mapping: wp.array2d[int]
    scale: wp.array2d[wp.vec3]
    """Factors of texture coordinates."""
    shift: wp.array[wp.vec2]
    """Added to texture coordinates."""
    cells: wp.array[wp.vec4]
    """Of planes: first grid line and distance of lines, along x, then along y. Metres.

    For an infinite plane, not the first line but the steps in which the grid follows the camera.
    """
    counts: wp.array[wp.vec2i]
    """Of planes: cells between the first and the last line; -1 for an infinite plane."""
    divisions: int
    """Parts into which OpenGL divides each side of a box's face."""
    slices: int
    """Parts into which it divides round solids, around their axis."""
    stacks: int
    """The same along the axis; half of it from the middle of a disk to its edge."""


@struct
class Mapping:
    """How a texture lies on a geom."""

    texture: int
    """-1 for none."""
    kind: int
    scale: wp.vec3
    shift: wp.vec2
    is_even: bool
    """Whether coordinates change evenly: those of a place p are start + (across @ p, down @ p)."""
    start: wp.vec2
    across: wp.vec3
    down: wp.vec3


@wp.func
def is_around(mapping: Mapping, kind: int, part: int) -> bool:
    """Return whether a texture goes around a round solid, with a seam."""
    return mapping.kind == WRAPPED and kind != MESH and part == ROUND


@wp.func
def texture_place(
    mapping: Mapping, kind: int, part: int, size: wp.vec3, normal: wp.vec3, place: wp.vec3
) -> wp.vec3:
    """Return texture coordinates of a place on a geom, but those of a mesh, geom's frame.

    Those of a cube map are a direction. `normal` is the surface's.
    """
    scale = mapping.scale
    if mapping.kind == CUBE:
        return wp.cw_mul(_stretch_ends(kind, size, place), scale)
    if mapping.kind == PROJECTED:
        return wp.vec3(place[0] * scale[0] - 0.5, -place[1] * scale[1] - 0.5, 0.0)
    if mapping.kind == TILED:
        axes = face_axes(
            int(wp.argmax(wp.vec3(wp.abs(normal[0]), wp.abs(normal[1]), wp.abs(normal[2]))))
        )
        return wp.vec3(place[axes[0]] * scale[0], -place[axes[1]] * scale[0], 0.0)
    at = wp.vec2()
    if kind == PLANE:
        at = wp.vec2(_along_plane(place[0], size[0]), 1.0 - _along_plane(place[1], size[1]))
        if size[1] <= 0.0:
            at[1] = at[1] - 1.0
    elif kind == BOX:
        axes = face_axes(part // 2)
        one, two = axes[0], axes[1]
        at = wp.vec2(0.5 + 0.5 * place[one] / size[one], 0.5 - 0.5 * place[two] / size[two])
    else:
        at = _round_coordinates(kind, part, size, place)
    shift = mapping.shift
    return wp.vec3(at[0] * scale[0] + shift[0], at[1] * scale[1] + shift[1], 0.0)


@wp.func
def face_axes(axis: int) -> wp.vec2i:
    """Return the axes along a face of a box, given that of its normal."""
    if axis == 0:
        return wp.vec2i(1, 2)
    if axis == 1:
        return wp.vec2i(0, 2)
    return wp.vec2i(0, 1)


@wp.func
def _stretch_ends(kind: int, size: wp.vec3, place: wp.vec3) -> wp.vec3:
    """Stretch the ends of a capsule as OpenGL does for cube maps."""
    half = size[1]
    beyond = wp.abs(place[2]) - half
    if kind != CAPSULE or beyond <= 0.0:
        return place
    return wp.vec3(place[0], place[1], wp.sign(place[2]) * half * (1.0 + beyond / size[0]))


@wp.func
def _along_plane(place: float, half: float) -> float:
    if half > 0.0:
        return (place + half) / (2.0 * half)
    return 0.5 * place


@wp.func
def _round_coordinates(kind: int, face: int, size: wp.vec3, place: wp.vec3) -> wp.vec2:
    part = round_part(kind, face, size, place)
    if part == DISK:
        return wp.vec2(0.5 + 0.5 * place[0] / size[0], 0.5 + 0.5 * place[1] / size[0])
    at = unroll(kind, size, part, place)
    if part == TUBE:
        return wp.vec2(at[0], 1.0 - at[1])
    if kind != CAPSULE:
        return wp.vec2(at[0], 0.5 - 0.5 * wp.sign(place[2]) * at[1])
    if place[2] > 0.0:
        return wp.vec2(at[0], 1.0 - at[1])
    return at


@wp.func
def round_part(kind: int, face: int, size: wp.vec3, place: wp.vec3) -> int:
    """Return the part of a ball, ellipsoid, capsule or cylinder that a place is on."""
    if kind == CYLINDER:
        if face == ROUND:
            return TUBE
        return DISK
    if kind == CAPSULE and wp.abs(place[2]) < size[1]:
        return TUBE
    return DOME


@wp.func
def radii(kind: int, size: wp.vec3) -> wp.vec3:
    """Return the factors that make a round solid of one with radius 1."""
    if kind == ELLIPSOID:
        return size
    return wp.vec3(size[0], size[0], size[0])


@wp.func
def unroll(kind: int, size: wp.vec3, part: int, place: wp.vec3) -> wp.vec2:
    """Return coordinates on a part of a round solid, each from 0 to 1.

    The first goes around the axis. The second goes along a tube, from the equator of a dome to its
    pole, or from the middle of a disk to its edge.
    """
    unit = wp.cw_div(place, radii(kind, size))
    around = wp.atan2(unit[1], unit[0]) / TURN
    if around < 0.0:
        around += 1.0
    flat = wp.sqrt(unit[0] * unit[0] + unit[1] * unit[1])
    if part == TUBE:
        return wp.vec2(around, 0.5 + 0.5 * place[2] / size[1])
    if part == DISK:
        return wp.vec2(around, flat)
    up = wp.abs(unit[2])
    if kind == CAPSULE:
        up -= size[1] / size[0]
    return wp.vec2(around, wp.atan2(up, flat) / (0.25 * TURN))
