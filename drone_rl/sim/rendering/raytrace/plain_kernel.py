# ruff: noqa: RUF046, UP018
# pyright: reportIndexIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles this file; Python's types say nothing about it, and what a loop changes is
# declared by its type.)
"""The ray tracer on a CPU: one picture after the other, geom by geom, then pixel by pixel.

First it finds out what is where. It takes the geoms in order and casts rays at each in the
rectangle of pixels around its projection alone, in the geom's own frame; what is nearer than all
before takes the pixel. All geoms are convex and closed, or planes seen from above, so a ray enters
each at most once, and there is no other hit to look for. Then it writes what each pixel shows,
which is worked out once for pixels in a row that show the same flat face.

Pixels are counted by `while`: what Warp makes of `for` is several times as slow on a CPU.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    FAR_AWAY,
    PLANE,
    ROUND,
    SAME,
    UPPER,
    enter,
    is_nearest,
    meet_plane,
    outward,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import around, look_at, stand
from drone_rl.sim.rendering.raytrace.shading_kernel import put_run, show_geom, show_sky
from drone_rl.sim.rendering.raytrace.spans_kernel import fill_floats, fill_ints, meet_level
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    Geoms,
    Looks,
    Pictures,
    Poses,
    Sight,
    View,
)

FACES = wp.constant(8)
"""Room for the faces of a geom."""
NOTHING = wp.constant(-1)
"""Owner of the sky."""

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class Desk:
    """Room to work for one picture at a time; first dimension: workers."""

    nearest: wp.array2d[float]
    """How far along its ray the nearest surface is, one a pixel."""
    owner: wp.array2d[int]
    """Whose that is: `FACES` times the geom's place among those drawn, and the face."""
    dark: wp.array2d[int]
    """Whether that is in shadow, where there may be any."""
    colors: wp.array2d[wp.vec3ub]
    """What is seen, where it is not the same for many pixels."""
    sights: wp.array2d[Sight]
    """One a geom."""


@wp.func
def _find_plane(
    view: View,
    rays: wp.array[wp.vec3],
    sight: Sight,
    geom: int,
    nearest: wp.array[float],
    owner: wp.array[int],
) -> None:
    """In the rows that end below its horizon; what both ends of a row show lies between, too."""
    mark = geom * FACES + UPPER
    start = int(0)
    while start < view.height * view.width:
        end = start + view.width
        left = sight.into @ rays[start]
        right = sight.into @ rays[end - 1]
        if left[2] < 0.0 or right[2] < 0.0:
            pixel = start
            leftmost, rightmost = rays[start], rays[end - 1]
            if _is_seen(view, sight, leftmost, left) and _is_seen(view, sight, rightmost, right):
                down, height = sight.into[2], -sight.eye[2]
                meet_level(nearest, owner, start, end, rays, down, height, SAME, mark)
                pixel = end
            while pixel < end:
                ray = rays[pixel]
                along = meet_plane(sight.size, sight.eye, sight.into @ ray)
                if is_nearest(along, nearest[pixel], -ray[2], view.far):
                    nearest[pixel] = along
                    owner[pixel] = mark
                pixel += 1
        start = end


@wp.func
def _is_seen(view: View, sight: Sight, ray: wp.vec3, into: wp.vec3) -> bool:
    """Whether a ray meets a plane."""
    along = meet_plane(sight.size, sight.eye, into)
    return along >= 0.0 and along * -ray[2] <= view.far


@wp.func
def _find_solid(
    view: View,
    part: wp.vec4i,
    rays: wp.array[wp.vec3],
    sight: Sight,
    geom: int,
    nearest: wp.array[float],
    owner: wp.array[int],
) -> None:
    """In a part of the picture."""
    row = part[2]
    while row < part[3]:
        pixel = row * view.width + part[0]
        end = row * view.width + part[1]
        while pixel < end:
            ray = rays[pixel]
            along, face = enter(sight.kind, sight.size, sight.eye, sight.into @ ray)
            if is_nearest(along, nearest[pixel], -ray[2], view.far):
                nearest[pixel] = along
                owner[pixel] = geom * FACES + face
            pixel += 1
        row += 1


@wp.func
def _show(
    view: View,
    rays: wp.array[wp.vec3],
    cosines: wp.array[float],
    looks: Looks,
    world: int,
    row: int,
    sights: wp.array[Sight],
    nearest: wp.array[float],
    owners: wp.array[int],
    pictures: Pictures,
) -> None:
    """Writes what each pixel shows."""
    count = view.height * view.width
    start = int(0)
    while start < count:
        owner = owners[start]
        end = start + 1
        if owner == NOTHING or owner % FACES != ROUND:
            while end < count and owners[end] == owner:
                end += 1
        shown = show_sky(looks, world)
        if owner == NOTHING:
            fill_floats(nearest, start, end, 0.0)
        else:
            sight = sights[owner // FACES]
            into = sight.into @ rays[start]
            face = owner % FACES
            normal = outward(sight.kind, sight.size, face, sight.eye, into, nearest[start])
            shown = show_geom(looks, world, sight.number, sight.axes @ normal)
        put_run(pictures, view.what, row, start, end, shown, nearest, cosines)
        start = end


@wp.func
def find(
    view: View, camera: int, geoms: Geoms, poses: Poses, world: int, desk: Desk, member: int
) -> None:
    """Finds out what is where, and leaves it on the desk; see `draw_picture`."""
    nearest = desk.nearest[member]
    owner = desk.owner[member]
    sights = desk.sights[member]
    rays = view.rays[camera]
    fill_floats(nearest, 0, view.height * view.width, FAR_AWAY)
    fill_ints(owner, 0, view.height * view.width, NOTHING)
    there = stand(view.cameras[camera], poses, world)
    for geom in range(geoms.kind.shape[0]):
        sight = look_at(geoms, geom, poses, world, there)
        sights[geom] = sight
        if sight.kind == PLANE:
            _find_plane(view, rays, sight, geom, nearest, owner)
        else:
            part = around(view, view.cameras[camera], sight)
            _find_solid(view, part, rays, sight, geom, nearest, owner)


@wp.func
def draw_picture(
    view: View,
    camera: int,
    geoms: Geoms,
    poses: Poses,
    world: int,
    looks: Looks,
    desk: Desk,
    member: int,
    pictures: Pictures,
    row: int,
) -> None:
    """Draws one camera's picture of a world.

    Args:
        view: What is asked for.
        camera: Which of its cameras.
        geoms: What is drawn.
        poses: Where it is.
        world: Which of these.
        looks: Colours and light.
        desk: To work at.
        member: Which of its places to work at.
        pictures: To draw into.
        row: Which of these.
    """
    find(view, camera, geoms, poses, world, desk, member)
    nearest, owner = desk.nearest[member], desk.owner[member]
    rays, cosines = view.rays[camera], view.cosines[camera]
    _show(view, rays, cosines, looks, world, row, desk.sights[member], nearest, owner, pictures)


@wp.kernel
def draw(
    first: int,
    last: int,
    member: int,
    view: View,
    geoms: Geoms,
    poses: Poses,
    looks: Looks,
    desk: Desk,
    pictures: Pictures,
) -> None:
    """Draws pictures one after the other, by a single worker: launch it with a dimension of 1.

    Args:
        first: The first picture.
        last: The one after the last.
        member: Which of the desk's places to work at.
        view: What is asked for.
        geoms: What is drawn.
        poses: Where it is.
        looks: Colours and light.
        desk: To work at.
        pictures: To draw into.
    """
    for row in range(first, last):
        world = row // view.count
        camera = row % view.cameras.shape[0]
        draw_picture(view, camera, geoms, poses, world, looks, desk, member, pictures, row)
