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
"""The ray tracer on a GPU: all pixels at once, a thread each, by the same functions as on a CPU."""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    FAR_AWAY,
    PLANE,
    UPPER,
    enter,
    is_nearest,
    meet_plane,
    outward,
)
from drone_rl.sim.rendering.raytrace.plain_kernel import Desk
from drone_rl.sim.rendering.raytrace.projection_kernel import look_at, stand
from drone_rl.sim.rendering.raytrace.shading_kernel import (
    Shown,
    color_geom,
    color_sky,
    put_colors,
    put_pixel,
    show_geom,
    show_sky,
)
from drone_rl.sim.rendering.raytrace.shadows_kernel import is_behind
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


@wp.kernel
def aim(view: View, geoms: Geoms, poses: Poses, sights: wp.array2d[Sight]) -> None:
    """Finds out where geoms are for cameras. Launch it with a dimension of pictures and of geoms.

    Args:
        view: What is asked for.
        geoms: What is drawn.
        poses: Where it is.
        sights: Are written.
    """
    row, geom = wp.tid()
    camera = view.cameras[row % view.cameras.shape[0]]
    world = row // view.count
    sights[row, geom] = look_at(geoms, geom, poses, world, stand(camera, poses, world))


@wp.func
def find_nearest(view: View, sights: wp.array[Sight], ray: wp.vec3) -> tuple[float, int, int]:
    """What a ray meets first: how far along it, which geom, -1 for none, and which of its faces."""
    nearest = float(FAR_AWAY)
    owner = int(-1)
    face = int(0)
    for geom in range(sights.shape[0]):
        sight = sights[geom]
        into = sight.into @ ray
        along = float(-1.0)
        found = int(UPPER)
        if sight.kind == PLANE:
            along = meet_plane(sight.size, sight.eye, into)
        else:
            along, found = enter(sight.kind, sight.size, sight.eye, into)
        if is_nearest(along, nearest, -ray[2], view.far):
            nearest = along
            owner = geom
            face = found
    return nearest, owner, face


@wp.kernel
def draw_pixels(view: View, sights: wp.array2d[Sight], looks: Looks, pictures: Pictures) -> None:
    """Draws pixels. Launch it with a dimension of pictures and of pixels.

    Args:
        view: What is asked for.
        sights: Of each picture, from `aim`.
        looks: Colours and light.
        pictures: To draw into.
    """
    row, pixel = wp.tid()
    world = row // view.count
    ray = view.rays[row % view.cameras.shape[0], pixel]
    nearest, owner, face = find_nearest(view, sights[row], ray)
    if owner < 0:
        put_pixel(pictures, view.what, row, pixel, show_sky(looks, world), 0.0, -ray[2])
    else:
        sight = sights[row, owner]
        normal = outward(sight.kind, sight.size, face, sight.eye, sight.into @ ray, nearest)
        shown = show_geom(looks, world, sight.number, sight.axes @ normal)
        put_pixel(pictures, view.what, row, pixel, shown, nearest, -ray[2])


wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def draw_scenic_pixels(
    view: View,
    poses: Poses,
    sights: wp.array2d[Sight],
    looks: Looks,
    scenery: Scenery,
    desk: Desk,
    pictures: Pictures,
) -> None:
    """Draws pixels. Launch it with a dimension of pictures and of pixels.

    Args:
        view: What is asked for.
        poses: Where everything is.
        sights: Of each picture, from `raytrace_pixels.aim`.
        looks: Colours and light.
        scenery: What there is besides.
        desk: With a place for each picture.
        pictures: To draw into.
    """
    row, pixel = wp.tid()
    world = row // view.count
    number = row % view.cameras.shape[0]
    camera, rays = view.cameras[number], view.rays[number]
    nearest, dark, colors = desk.nearest[row], desk.dark[row], desk.colors[row]
    ray, last = rays[pixel], pixel + 1
    distance, owner, face = find_nearest(view, sights[row], ray)
    shown = Shown()
    shown.number = -1
    if owner < 0:
        distance = 0.0
        color_sky(colors, pixel, last, rays, camera, poses, looks, scenery, world)
    else:
        sight = sights[row, owner]
        into = sight.into @ ray
        normal = outward(sight.kind, sight.size, face, sight.eye, into, distance)
        shown.number = sight.number
        shown.normal = sight.axes @ normal
        nearest[pixel] = distance
        dark[pixel] = 0
        if scenery.shadows[world % scenery.shadows.shape[0]] != 0:
            sun = looks.direction[world % looks.direction.shape[0], 0]
            for geom in range(sights.shape[1]):
                if geom != owner and sights[row, geom].kind != PLANE:
                    shone = wp.transpose(sights[row, geom].axes) @ sun
                    dark[pixel] |= int(is_behind(sights[row, geom], ray, distance, shone))
        color_geom(
            colors,
            pixel,
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
    put_pixel(pictures, view.what & ~(RGB | GRAY), row, pixel, shown, distance, -ray[2])
    put_colors(pictures, view.what, row, pixel, last, colors)
