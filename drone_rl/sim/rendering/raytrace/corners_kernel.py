"""Triangles into which MuJoCo's OpenGL divides geoms: it lights their corners."""

import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, Hit, World
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX, CAPSULE, PLANE
from drone_rl.sim.rendering.raytrace.structs_kernel import struct
from drone_rl.sim.rendering.raytrace.surfaces_kernel import (
    DISK,
    DOME,
    TUBE,
    TURN,
    Surfaces,
    face_axes,
    mesh_weights,
    radii,
    round_part,
    unroll,
)
from drone_rl.sim.rendering.raytrace.triangles_kernel import triangle_corner

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_SMALL = wp.constant(2.0)
"""Pixels: in smaller triangles the point itself is lit, which is faster and looks the same."""


@struct
class Corners:
    """The triangle that a point is on, geom's frame, or the point alone."""

    count: int
    """3, or 1 for the point."""
    places: wp.mat33
    """A corner in each row."""
    normals: wp.mat33
    weights: wp.vec3


@struct
class Half:
    """One half of a square of side 1, on either side of a diagonal, and a point in it."""

    corners: wp.mat33
    """A corner in each row, x and y."""
    weights: wp.vec3


@wp.func
def find_corners(surfaces: Surfaces, world: World, hit: Hit, eye: wp.vec3, pixel: float) -> Corners:
    """Return the triangle around a point, of which a pixel shows `pixel` metres.

    `eye` is the camera's position, world frame.
    """
    if hit.kind == MESH:
        return _mesh_corners(world, hit, pixel)
    if hit.kind == PLANE:
        cells, counts = surfaces.cells[hit.geom], surfaces.counts[hit.geom]
        above = hit.local - wp.transpose(hit.axes) @ (hit.point - eye)
        x_first, y_first = (
            _first(cells[0], counts[0], above[0]),
            _first(cells[2], counts[1], above[1]),
        )
        x = _cell(hit.local[0], x_first, cells[1], counts[0], hit.size[0])
        y = _cell(hit.local[1], y_first, cells[3], counts[1], hit.size[1])
        return _flat_corners(hit, wp.vec2i(0, 1), x, y, False, wp.vec3(0.0, 0.0, 1.0), pixel)
    if hit.kind == BOX:
        axes, parts = face_axes(hit.part // 2), surfaces.divisions
        one, two = hit.size[axes[0]], hit.size[axes[1]]
        x = _cell(hit.local[axes[0]], -one, 2.0 * one / float(parts), parts, one)
        y = _cell(hit.local[axes[1]], -two, 2.0 * two / float(parts), parts, two)
        is_main = hit.part == 0 or hit.part == 3 or hit.part == 4
        return _flat_corners(hit, axes, x, y, is_main, hit.local_normal, pixel)
    return _round_corners(surfaces, hit, pixel)


@wp.func
def _point_alone(hit: Hit, normal: wp.vec3) -> Corners:
    corners = Corners()
    corners.count = 1
    corners.places[0] = hit.local
    corners.normals[0] = normal
    corners.weights[0] = 1.0
    return corners


@wp.func
def _mesh_corners(world: World, hit: Hit, pixel: float) -> Corners:
    first = triangle_corner(world.triangles, hit.part, 0)
    second = triangle_corner(world.triangles, hit.part, 1)
    if wp.length_sq(second - first) < (_SMALL * pixel) * (_SMALL * pixel):
        return _point_alone(hit, wp.transpose(hit.axes) @ hit.normal)
    corners = Corners()
    corners.count = 3
    corners.weights = mesh_weights(world, hit.part, hit.local)
    corner = int(0)
    while corner < 3:
        corners.places[corner] = triangle_corner(world.triangles, hit.part, corner)
        corners.normals[corner] = world.triangles.normals[3 * hit.part + corner]
        corner += 1
    return corners


@wp.func
def _first(stored: float, count: int, eye: float) -> float:
    """Return a grid line; the grid of an infinite plane follows the camera in steps."""
    if count < 0:
        return stored * wp.round(eye / stored)
    return stored


@wp.func
def _cell(place: float, first: float, width: float, count: int, half: float) -> wp.vec2:
    """Return the grid lines around a coordinate; the outermost cells end at `half`, if any."""
    number = wp.floor((place - first) / width)
    if count < 0:
        return wp.vec2(first + number * width, first + (number + 1.0) * width)
    number = wp.clamp(number, -1.0, float(count))
    low, high = first + number * width, first + (number + 1.0) * width
    return wp.vec2(wp.max(low, -half), wp.min(high, half))


@wp.func
def _flat_corners(
    hit: Hit,
    axes: wp.vec2i,
    x: wp.vec2,
    y: wp.vec2,
    is_main: bool,
    normal: wp.vec3,
    pixel: float,
) -> Corners:
    """Return half of a rectangle with ends `x` and `y` along `axes`; see `_halve`."""
    wide, high = wp.max(x[1] - x[0], 1e-9), wp.max(y[1] - y[0], 1e-9)
    if wp.max(wide, high) < _SMALL * pixel:
        return _point_alone(hit, normal)
    right = wp.clamp((hit.local[axes[0]] - x[0]) / wide, 0.0, 1.0)
    up = wp.clamp((hit.local[axes[1]] - y[0]) / high, 0.0, 1.0)
    half = _halve(right, up, is_main)
    corners = Corners()
    corners.count = 3
    corners.weights = half.weights
    corner = int(0)
    while corner < 3:
        place = hit.local
        place[axes[0]] = x[0] + half.corners[corner, 0] * wide
        place[axes[1]] = y[0] + half.corners[corner, 1] * high
        corners.places[corner] = place
        corners.normals[corner] = normal
        corner += 1
    return corners


@wp.func
def _halve(x: float, y: float, is_main: bool) -> Half:
    """Return half of a square with side 1; the main diagonal leads from (0, 0) to (1, 1)."""
    half = Half()
    if is_main:
        if y > x:
            half.corners = wp.mat33(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0)
            half.weights = wp.vec3(1.0 - y, y - x, x)
        else:
            half.corners = wp.mat33(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0)
            half.weights = wp.vec3(1.0 - x, x - y, y)
    elif x + y > 1.0:
        half.corners = wp.mat33(1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        half.weights = wp.vec3(x + y - 1.0, 1.0 - y, 1.0 - x)
    else:
        half.corners = wp.mat33(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        half.weights = wp.vec3(1.0 - x - y, x, y)
    return half


@wp.func
def _round_corners(surfaces: Surfaces, hit: Hit, pixel: float) -> Corners:
    """Return corners on a ball, ellipsoid, capsule or cylinder, divided in slices and stacks.

    Triangles around a pole have it as one corner.
    """
    size, part = radii(hit), round_part(hit)
    if TURN * wp.max(size[0], size[2]) < _SMALL * pixel * float(surfaces.slices):
        return _point_alone(hit, hit.local_normal)
    stacks = float(surfaces.stacks)
    if part != TUBE:
        stacks = float(surfaces.stacks // 2)
    at = unroll(hit, part, hit.local)
    around, along = at[0] * float(surfaces.slices), at[1] * stacks
    slice, stack = wp.floor(around), wp.clamp(wp.floor(along), 0.0, stacks - 1.0)
    x, y = around - slice, wp.clamp(along - stack, 0.0, 1.0)
    is_low = hit.local[2] < 0.0
    half = _halve(x, y, (part == DOME and is_low) or (part == DISK and not is_low))
    if part == DOME and stack == stacks - 1.0:
        half.corners = wp.mat33(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        half.weights = wp.vec3((1.0 - x) * (1.0 - y), x * (1.0 - y), y)
    if part == DISK and stack == 0.0:
        half.corners = wp.mat33(0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)
        half.weights = wp.vec3((1.0 - x) * y, x * y, 1.0 - y)
    corners = Corners()
    corners.count = 3
    corners.weights = half.weights
    corner = int(0)
    while corner < 3:
        turn = (slice + half.corners[corner, 0]) / float(surfaces.slices)
        up = (stack + half.corners[corner, 1]) / stacks
        normal = _roll(hit, part, turn, up)
        corners.places[corner] = _round_place(hit, part, normal, up)
        corners.normals[corner] = wp.normalize(wp.cw_div(normal, size))
        if part == DISK:
            corners.normals[corner] = hit.local_normal
        corner += 1
    return corners


@wp.func
def _roll(hit: Hit, part: int, around: float, along: float) -> wp.vec3:
    """Return the direction from the axis, or a dome's centre, for coordinates of `unroll`."""
    x, y = wp.cos(TURN * around), wp.sin(TURN * around)
    if part != DOME:
        return wp.vec3(x, y, 0.0)
    flat = wp.cos(0.25 * TURN * along)
    return wp.vec3(flat * x, flat * y, wp.sign(hit.local[2]) * wp.sin(0.25 * TURN * along))


@wp.func
def _round_place(hit: Hit, part: int, direction: wp.vec3, along: float) -> wp.vec3:
    size = radii(hit)
    if part == DISK:
        out = along * size[0]
        return wp.vec3(out * direction[0], out * direction[1], hit.local[2])
    place = wp.cw_mul(direction, size)
    if part == TUBE:
        place[2] = hit.size[1] * (2.0 * along - 1.0)
    elif hit.kind == CAPSULE:
        place[2] = place[2] + wp.sign(hit.local[2]) * hit.size[1]
    return place
