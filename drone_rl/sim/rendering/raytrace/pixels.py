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

from drone_rl.sim.rendering.raytrace.sight import look_at, stand
from drone_rl.sim.rendering.raytrace.solids import (
    FAR_AWAY,
    PLANE,
    UPPER,
    enter,
    is_nearest,
    meet_plane,
    outward,
)
from drone_rl.sim.rendering.raytrace.structs import Geoms, Looks, Pictures, Poses, Sight, View
from drone_rl.sim.rendering.raytrace.surface import put_pixel, show_geom, show_sky

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
