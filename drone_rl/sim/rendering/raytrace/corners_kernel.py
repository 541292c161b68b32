"""Triangles into which MuJoCo's OpenGL divides geoms: it lights their corners.

Flat faces have a grid of rectangles, round solids slices and stacks; a corner is a pair of whole
numbers on that grid, so that the next pixels can use its color again. Light changes evenly over a
triangle, so that it is found once for a `Patch` of a flat face.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import MESH
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX, CAPSULE, PLANE, ROUND
from drone_rl.sim.rendering.raytrace.structs_kernel import struct
from drone_rl.sim.rendering.raytrace.surfaces_kernel import (
    DISK,
    DOME,
    TUBE,
    TURN,
    face_axes,
    radii,
    round_part,
    unroll,
)
from drone_rl.sim.rendering.raytrace.triangles_kernel import Triangles, triangle_corner

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SMALL = wp.constant(2.0)
"""Pixels: in smaller triangles the point itself is lit, which is faster and looks the same."""


@struct
class Face:
    """A face of a geom, or its whole surface if it is round, in the geom's frame."""

    kind: int
    part: int
    """Face or triangle; see `Hit`."""
    size: wp.vec3
    normal: wp.vec3
    """Of a flat face or triangle."""
    is_round: bool
    has_patches: bool
    axes: wp.vec2i
    """Of the grid on a flat face."""
    first: wp.vec2
    """Grid line 0."""
    width: wp.vec2
    """Distance of grid lines."""
    counts: wp.vec2i
    """Cells between the first and the last line; -1 for an infinite face."""
    level: float
    """The coordinate that all points of a flat face share."""
    is_main: bool
    """Whether the main diagonal divides rectangles, from the first to the last corner."""
    slices: int
    stacks: int


@struct
class Patch:
    """A rectangle of a flat face's grid, or a triangle of a mesh: where its corners are.

    A place p, geom's frame, has the coordinates (across @ p, up @ p) + shift, from 0 to 1.
    """

    state: int
    """NEW, PLACED or LIT."""
    across: wp.vec3
    up: wp.vec3
    shift: wp.vec2
    cut: wp.vec3
    """Its second half is where the coordinates (x, y, 1) and this have a positive product."""
    edge: float
    """Metres; patches with a shorter edge than `SMALL` pixels are lit at each point."""
    column: int
    """The first corner's place on the grid."""
    row: int


NEW = wp.constant(0)
"""The patch of another face was lit last."""
PLACED = wp.constant(1)
"""Coordinates are known, ..."""
LIT = wp.constant(2)
"""... and so is the light."""


@struct
class Cell:
    """The triangle of a round solid that a point is on."""

    count: int
    """3, or 1 if the triangle is so small that the point itself is lit."""
    x: wp.vec3i
    """Each corner's place on the grid."""
    y: wp.vec3i
    weights: wp.vec3
    side: int
    """Part of a round solid, twice, plus 1 below its middle."""


@wp.func
def place_rectangle(face: Face, local: wp.vec3) -> Patch:
    """Return the rectangle around a place on the grid of a plane or a box."""
    column, row = _number(face, 0, local[face.axes[0]]), _number(face, 1, local[face.axes[1]])
    left, low = _line(face, 0, column), _line(face, 1, row)
    wide = wp.max(_line(face, 0, column + 1) - left, 1e-9)
    high = wp.max(_line(face, 1, row + 1) - low, 1e-9)
    patch = Patch()
    patch.state = PLACED
    patch.across[face.axes[0]] = 1.0 / wide
    patch.up[face.axes[1]] = 1.0 / high
    patch.shift = wp.vec2(-left / wide, -low / high)
    patch.cut = wp.vec3(1.0, 1.0, -1.0)
    if face.is_main:
        patch.cut = wp.vec3(-1.0, 1.0, 0.0)
    patch.edge = wp.max(wide, high)
    patch.column = column
    patch.row = row
    return patch


@wp.func
def place_triangle(triangles: Triangles, triangle: int) -> Patch:
    """Return a triangle of a mesh, whose coordinates are the weights of its later corners."""
    first = triangle_corner(triangles, triangle, 0)
    one = triangle_corner(triangles, triangle, 1) - first
    two = triangle_corner(triangles, triangle, 2) - first
    normal = wp.cross(one, two)
    per_area = 1.0 / wp.max(wp.length_sq(normal), 1e-30)
    patch = Patch()
    patch.state = PLACED
    patch.across = per_area * wp.cross(two, normal)
    patch.up = per_area * wp.cross(normal, one)
    patch.shift = -wp.vec2(wp.dot(patch.across, first), wp.dot(patch.up, first))
    patch.cut = wp.vec3(0.0, 0.0, -1.0)
    patch.edge = wp.length(one)
    return patch


@wp.func
def _line(face: Face, axis: int, number: int) -> float:
    """Return the coordinate of a grid line; those beyond the face's edge are on the edge."""
    place = face.first[axis] + float(number) * face.width[axis]
    if face.counts[axis] < 0:
        return place
    half = face.size[face.axes[axis]]
    return wp.clamp(place, -half, half)


@wp.func
def _number(face: Face, axis: int, place: float) -> int:
    number = int(wp.floor((place - face.first[axis]) / face.width[axis]))
    if face.counts[axis] < 0:
        return number
    return wp.clamp(number, -1, face.counts[axis])


@wp.func
def _halve(column: int, row: int, x: float, y: float, is_main: bool) -> Cell:
    """Return half of a rectangle, in which a point has coordinates from 0 to 1."""
    cell = Cell()
    cell.count = 3
    next, above = column + 1, row + 1
    if is_main:
        if y > x:
            cell.x = wp.vec3i(column, column, next)
            cell.y = wp.vec3i(row, above, above)
            cell.weights = wp.vec3(1.0 - y, y - x, x)
        else:
            cell.x = wp.vec3i(column, next, next)
            cell.y = wp.vec3i(row, row, above)
            cell.weights = wp.vec3(1.0 - x, x - y, y)
    elif x + y > 1.0:
        cell.x = wp.vec3i(next, next, column)
        cell.y = wp.vec3i(above, row, above)
        cell.weights = wp.vec3(x + y - 1.0, 1.0 - y, 1.0 - x)
    else:
        cell.x = wp.vec3i(column, next, column)
        cell.y = wp.vec3i(row, row, above)
        cell.weights = wp.vec3(1.0 - x - y, x, y)
    return cell


@wp.func
def find_cell(face: Face, local: wp.vec3, pixel: float) -> Cell:
    """Return the triangle around a point of a round solid that shows `pixel` metres in a pixel.

    Triangles are in slices and stacks; those around a pole have it as one corner.
    """
    size = radii(face.kind, face.size)
    if TURN * wp.max(size[0], size[2]) < SMALL * pixel * float(face.slices):
        alone = Cell()
        alone.count = 1
        return alone
    part = round_part(face.kind, face.part, face.size, local)
    stacks = _stacks(face, part)
    at = unroll(face.kind, face.size, part, local)
    around, along = at[0] * float(face.slices), at[1] * float(stacks)
    slice = int(wp.floor(around))
    stack = wp.clamp(int(wp.floor(along)), 0, stacks - 1)
    x, y = around - float(slice), wp.clamp(along - float(stack), 0.0, 1.0)
    is_low = local[2] < 0.0
    cell = _halve(slice, stack, x, y, (part == DOME and is_low) or (part == DISK and not is_low))
    if part == DOME and stack == stacks - 1:
        cell.x = wp.vec3i(slice, slice + 1, slice)
        cell.y = wp.vec3i(stack, stack, stack + 1)
        cell.weights = wp.vec3((1.0 - x) * (1.0 - y), x * (1.0 - y), y)
    if part == DISK and stack == 0:
        cell.x = wp.vec3i(slice, slice + 1, slice)
        cell.y = wp.vec3i(1, 1, 0)
        cell.weights = wp.vec3((1.0 - x) * y, x * y, 1.0 - y)
    cell.side = 2 * part
    if is_low:
        cell.side += 1
    return cell


@wp.func
def _stacks(face: Face, part: int) -> int:
    if part == TUBE:
        return face.stacks
    return face.stacks // 2


@wp.func
def find_corner(face: Face, side: int, x: int, y: int) -> tuple[wp.vec3, wp.vec3]:
    """Return place and unit normal of a corner on a face's grid; see `Cell`."""
    if face.kind == PLANE or face.kind == BOX:
        place = wp.vec3(face.level, face.level, face.level)
        place[face.axes[0]] = _line(face, 0, x)
        place[face.axes[1]] = _line(face, 1, y)
        return place, face.normal
    part, upwards = side // 2, float(1.0)
    if side % 2 == 1:
        upwards = -1.0
    along = float(y) / float(_stacks(face, part))
    turn = TURN * float(x) / float(face.slices)
    out = wp.vec3(wp.cos(turn), wp.sin(turn), 0.0)
    size = radii(face.kind, face.size)
    if part == DISK:
        far = along * size[0]
        return wp.vec3(far * out[0], far * out[1], face.level), face.normal
    if part == DOME:
        flat, up = wp.cos(0.25 * TURN * along), wp.sin(0.25 * TURN * along)
        out = wp.vec3(flat * out[0], flat * out[1], upwards * up)
    place = wp.cw_mul(out, size)
    if part == TUBE:
        place[2] = face.size[1] * (2.0 * along - 1.0)
    elif face.kind == CAPSULE:
        place[2] = place[2] + upwards * face.size[1]
    return place, wp.normalize(wp.cw_div(out, size))


@wp.func
def grid_face(
    kind: int,
    part: int,
    size: wp.vec3,
    normal: wp.vec3,
    cells: wp.vec4,
    counts: wp.vec2i,
    eye: wp.vec3,
    divisions: int,
    slices: int,
    stacks: int,
) -> Face:
    """Return a face, given what `Surfaces` says of its geom; `eye` is the camera, geom's frame."""
    face = Face()
    face.kind = kind
    face.part = part
    face.size = size
    face.normal = normal
    face.is_round = kind != MESH and part == ROUND
    face.has_patches = True
    face.slices = slices
    face.stacks = stacks
    if kind == PLANE:
        face.axes = wp.vec2i(0, 1)
        face.first = wp.vec2(
            _first(cells[0], counts[0], eye[0]), _first(cells[2], counts[1], eye[1])
        )
        face.width = wp.vec2(cells[1], cells[3])
        face.counts = counts
        face.normal = wp.vec3(0.0, 0.0, 1.0)
    elif kind == BOX:
        face.axes = face_axes(part // 2)
        one, two = size[face.axes[0]], size[face.axes[1]]
        face.first = wp.vec2(-one, -two)
        face.width = wp.vec2(2.0 * one / float(divisions), 2.0 * two / float(divisions))
        face.counts = wp.vec2i(divisions, divisions)
        face.level = size[part // 2] * normal[part // 2]
        face.is_main = part == 0 or part == 3 or part == 4
    elif kind != MESH:
        face.level = size[1] * normal[2]
        face.has_patches = False
    return face


@wp.func
def _first(stored: float, count: int, eye: float) -> float:
    """Return a grid line; the grid of an infinite plane follows the camera in steps."""
    if count < 0:
        return stored * wp.round(eye / stored)
    return stored
