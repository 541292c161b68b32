"""The ray tracer on a GPU: one thread per pixel, with the same functions as on a CPU."""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    FAR_AWAY,
    PLANE,
    UPPER,
    intersect_plane,
    intersect_solid,
    is_nearest,
    surface_normal,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import camera_pose, view_geom
from drone_rl.sim.rendering.raytrace.shading_kernel import (
    color_geom,
    color_sky,
    geom_pixel,
    sky_pixel,
    write_colors,
    write_pixel,
)
from drone_rl.sim.rendering.raytrace.shadows_kernel import is_shadowed

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def view_geoms(
    view: structs.View,
    geoms: structs.Geoms,
    poses: structs.Poses,
    geom_views: wp.array2d[structs.GeomView],
) -> None:
    """Compute all geoms relative to all cameras. Launch it with (num_images, num_geoms)."""
    row, geom = wp.tid()
    camera = view.cameras[row % view.cameras.shape[0]]
    world = row // view.count
    geom_views[row, geom] = view_geom(geoms, geom, poses, world, camera_pose(camera, poses, world))


@wp.func
def cast_ray(
    view: structs.View, geom_views: wp.array[structs.GeomView], ray: wp.vec3
) -> tuple[float, int, int]:
    """Cast a ray: return the distance, the nearest geom, `NO_GEOM` for none, and its face."""
    nearest = float(FAR_AWAY)
    owner = int(structs.NO_GEOM)
    face = int(0)
    for geom in range(geom_views.shape[0]):
        geom_view = geom_views[geom]
        into = geom_view.into @ ray
        along = float(-1.0)
        found = int(UPPER)
        if geom_view.kind == PLANE:
            along = intersect_plane(geom_view.size, geom_view.eye, into)
        else:
            along, found = intersect_solid(geom_view.kind, geom_view.size, geom_view.eye, into)
        if is_nearest(along, nearest, -ray[2], view.far):
            nearest = along
            owner = geom
            face = found
    return nearest, owner, face


@wp.kernel
def render_pixels(
    view: structs.View,
    geom_views: wp.array2d[structs.GeomView],
    materials: structs.Materials,
    images: structs.Images,
) -> None:
    """Render pixels without effects. Launch it with (num_images, num_pixels)."""
    row, pixel = wp.tid()
    world = row // view.count
    ray = view.rays[row % view.cameras.shape[0], pixel]
    nearest, owner, face = cast_ray(view, geom_views[row], ray)
    if owner < 0:
        write_pixel(images, view.what, row, pixel, sky_pixel(materials, world), 0.0, -ray[2])
    else:
        geom_view = geom_views[row, owner]
        kind, size, eye = geom_view.kind, geom_view.size, geom_view.eye
        normal = surface_normal(kind, size, face, eye, geom_view.into @ ray, nearest)
        shown = geom_pixel(materials, world, geom_view.number, geom_view.axes @ normal)
        write_pixel(images, view.what, row, pixel, shown, nearest, -ray[2])


@wp.kernel
def render_pixels_with_effects(
    view: structs.View,
    poses: structs.Poses,
    geom_views: wp.array2d[structs.GeomView],
    materials: structs.Materials,
    effects: structs.Effects,
    scratch: structs.Scratch,
    images: structs.Images,
) -> None:
    """Render pixels with effects, with one scratch buffer per image; see `render_pixels`."""
    row, pixel = wp.tid()
    world = row // view.count
    number = row % view.cameras.shape[0]
    camera, rays = view.cameras[number], view.rays[number]
    nearest, dark, colors = scratch.nearest[row], scratch.dark[row], scratch.colors[row]
    ray, last = rays[pixel], pixel + 1
    distance, owner, face = cast_ray(view, geom_views[row], ray)
    shown = structs.PixelValue()
    shown.number = structs.NO_GEOM
    if owner < 0:
        distance = 0.0
        color_sky(colors, pixel, last, rays, camera, poses, materials, effects, world)
    else:
        geom_view = geom_views[row, owner]
        into = geom_view.into @ ray
        normal = surface_normal(geom_view.kind, geom_view.size, face, geom_view.eye, into, distance)
        shown.number = geom_view.number
        shown.normal = geom_view.axes @ normal
        nearest[pixel] = distance
        dark[pixel] = 0
        if effects.shadows[world % effects.shadows.shape[0]] != 0:
            sun = materials.direction[world % materials.direction.shape[0], 0]
            for geom in range(geom_views.shape[1]):
                caster = geom_views[row, geom]
                if geom != owner and caster.kind != PLANE:
                    light = wp.transpose(caster.axes) @ sun
                    dark[pixel] |= int(is_shadowed(caster, ray, distance, light))
        color_geom(
            colors,
            pixel,
            last,
            rays,
            nearest,
            dark,
            view,
            camera,
            materials,
            effects,
            world,
            geom_view,
            face,
            normal,
        )
    write_pixel(
        images, view.what & ~(structs.RGB | structs.GRAY), row, pixel, shown, distance, -ray[2]
    )
    write_colors(images, view.what, row, pixel, last, colors)
