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
"""The ray tracer on a GPU for worlds that look like something; see `raytrace_pixels`."""

import warp as wp

from drone_rl.sim.rendering.raytrace.kernel import Desk
from drone_rl.sim.rendering.raytrace.pixels import find_nearest
from drone_rl.sim.rendering.raytrace.scenic_surface import color_geom, color_sky
from drone_rl.sim.rendering.raytrace.shadows import is_behind
from drone_rl.sim.rendering.raytrace.solids import PLANE, outward
from drone_rl.sim.rendering.raytrace.structs import (
    GRAY,
    RGB,
    Looks,
    Pictures,
    Poses,
    Scenery,
    Sight,
    View,
)
from drone_rl.sim.rendering.raytrace.surface import Shown, put_colors, put_pixel

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
