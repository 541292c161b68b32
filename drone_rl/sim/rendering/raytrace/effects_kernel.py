# ruff: noqa: RUF046, UP018
# pyright: reportIndexIssue=false
# pyright: reportAssignmentType=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles this file; Python's types say nothing about it, and what a loop changes is
# declared by its type.)
"""The ray tracer on a CPU for worlds that look like something; see `raytrace_kernel`.

What is where is found by the same functions; then solids cast shadows, each in the rectangle of
pixels around it and its shadow alone; then each pixel is coloured by itself.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX, PLANE, ROUND, outward
from drone_rl.sim.rendering.raytrace.plain_kernel import FACES, NOTHING, Desk, find
from drone_rl.sim.rendering.raytrace.shading_kernel import (
    Shown,
    color_geom,
    color_sky,
    put_colors,
    put_run,
)
from drone_rl.sim.rendering.raytrace.shadows_kernel import (
    MAYBE,
    around_shadow,
    find_ground,
    hide_by_box,
    is_behind,
    mark_near,
    shadow_length,
)
from drone_rl.sim.rendering.raytrace.spans_kernel import fill_floats, fill_ints
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    GRAY,
    RGB,
    Geoms,
    Looks,
    Pictures,
    Poses,
    Scenery,
    Sight,
    View,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.func
def _cast(view: View, number: int, sun: wp.vec3, desk: Desk, member: int) -> None:
    """Marks the pixels of a camera that are in shadow."""
    camera, rays, sights = view.cameras[number], view.rays[number], desk.sights[member]
    nearest, owners, dark = desk.nearest[member], desk.owner[member], desk.dark[member]
    ground = find_ground(view, sights, sun)
    for geom in range(sights.shape[0]):
        if sights[geom].kind != PLANE:
            sight = sights[geom]
            way = sun * shadow_length(view, sights, geom, ground, sun)
            part = around_shadow(view, camera, sight, way)
            shone = wp.transpose(sight.axes) @ sun
            row = part[2]
            while row < part[3]:
                first, last = row * view.width + part[0], row * view.width + part[1]
                if sight.kind == BOX:
                    hide_by_box(dark, first, last, rays, nearest, owners, FACES, geom, sight, shone)
                else:
                    _hide(dark, first, last, rays, nearest, owners, geom, sight, shone)
                row += 1


@wp.func
def _hide(
    dark: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    owners: wp.array[int],
    geom: int,
    sight: Sight,
    sun: wp.vec3,
) -> None:
    """The same as `hide_by_box`, by any solid."""
    mark_near(dark, first, last, rays, nearest, owners, FACES, geom, sight, sun, MAYBE)
    pixel = first
    while pixel < last:
        if dark[pixel] == MAYBE:
            dark[pixel] = int(is_behind(sight, rays[pixel], nearest[pixel], sun))
        pixel += 1


@wp.func
def _show(
    view: View,
    number: int,
    poses: Poses,
    looks: Looks,
    scenery: Scenery,
    world: int,
    row: int,
    desk: Desk,
    member: int,
    pictures: Pictures,
) -> None:
    """Writes what each pixel shows."""
    camera, rays, cosines = view.cameras[number], view.rays[number], view.cosines[number]
    nearest, owners, dark = desk.nearest[member], desk.owner[member], desk.dark[member]
    colors = desk.colors[member]
    count = view.height * view.width
    first = int(0)
    while first < count:
        owner = owners[first]
        last = first + 1
        if owner == NOTHING or owner % FACES != ROUND:
            while last < count and owners[last] == owner:
                last += 1
        shown = Shown()
        shown.number = -1
        if owner == NOTHING:
            fill_floats(nearest, first, last, 0.0)
            color_sky(colors, first, last, rays, camera, poses, looks, scenery, world)
        else:
            sight = desk.sights[member, owner // FACES]
            face = owner % FACES
            into = sight.into @ rays[first]
            normal = outward(sight.kind, sight.size, face, sight.eye, into, nearest[first])
            shown.number = sight.number
            shown.normal = sight.axes @ normal
            color_geom(
                colors,
                first,
                last,
                rays,
                nearest,
                dark,
                view,
                camera,
                looks,
                scenery,
                world,
                sight,
                face,
                normal,
            )
        put_run(pictures, view.what & ~(RGB | GRAY), row, first, last, shown, nearest, cosines)
        first = last
    put_colors(pictures, view.what, row, 0, count, colors)


@wp.kernel
def draw_scenic(
    first: int,
    last: int,
    member: int,
    view: View,
    geoms: Geoms,
    poses: Poses,
    looks: Looks,
    scenery: Scenery,
    desk: Desk,
    pictures: Pictures,
) -> None:
    """Draws pictures one after the other, by a single worker; see `raytrace_kernel.draw`.

    Args:
        first: The first picture.
        last: The one after the last.
        member: Which of the desk's places to work at.
        view: What is asked for.
        geoms: What is drawn.
        poses: Where it is.
        looks: Colours and light.
        scenery: What there is besides.
        desk: To work at.
        pictures: To draw into.
    """
    for row in range(first, last):
        world = row // view.count
        number = row % view.cameras.shape[0]
        find(view, number, geoms, poses, world, desk, member)
        fill_ints(desk.dark[member], 0, view.height * view.width, 0)
        if scenery.shadows[world % scenery.shadows.shape[0]] != 0:
            _cast(view, number, looks.direction[world % looks.direction.shape[0], 0], desk, member)
        _show(view, number, poses, looks, scenery, world, row, desk, member, pictures)
