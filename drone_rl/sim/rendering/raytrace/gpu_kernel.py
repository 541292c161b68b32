"""The ray tracer on a GPU: one thread per pixel, with the same functions as on a CPU."""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.effects_kernel import is_shadowed
from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    FAR_AWAY,
    PLANE,
    UPPER,
    intersect_plane,
    intersect_solid,
    is_nearest,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import start_job, view_geom
from drone_rl.sim.rendering.raytrace.shading_kernel import shade_span, shade_span_with_effects

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def view_geoms(
    view: structs.ViewArrays,
    geoms: structs.Geoms,
    poses: structs.PoseArrays,
    scratch: structs.Scratch,
) -> None:
    """Compute all geoms relative to all cameras. Launch it with (num_images, num_geoms)."""
    row, geom = wp.tid()
    job = _start(view, poses, scratch, row)
    job.geom_views[geom] = view_geom(job, geoms, geom, poses)


@wp.kernel
def render_pixels(
    view: structs.ViewArrays,
    poses: structs.PoseArrays,
    materials: structs.Materials,
    scratch: structs.Scratch,
    images: structs.Images,
) -> None:
    """Render pixels without effects. Launch it with (num_images, num_pixels)."""
    row, pixel = wp.tid()
    job = _start(view, poses, scratch, row)
    nearest, owner = _cast_ray(job, pixel)
    if (view.what & structs.DISTANCES) != 0:
        job.nearest[pixel] = nearest
    shade_span(job, materials, images, pixel, pixel + 1, owner, nearest)


@wp.kernel
def render_pixels_with_effects(
    view: structs.ViewArrays,
    poses: structs.PoseArrays,
    materials: structs.Materials,
    scratch: structs.Scratch,
    images: structs.Images,
    effects: structs.Effects,
) -> None:
    """Render pixels with effects; see `render_pixels`."""
    row, pixel = wp.tid()
    job = _start(view, poses, scratch, row)
    nearest, owner = _cast_ray(job, pixel)
    job.nearest[pixel] = nearest
    job.owner[pixel] = owner
    job.dark[pixel] = 0
    if owner != structs.NO_GEOM and effects.shadows[job.env % effects.shadows.shape[0]] != 0:
        sun = materials.direction[job.env % materials.direction.shape[0], 0]
        for geom in range(job.geom_views.shape[0]):
            caster = job.geom_views[geom]
            if geom != owner // structs.FACES and caster.kind != PLANE:
                light = wp.transpose(caster.axes) @ sun
                job.dark[pixel] |= int(is_shadowed(caster, job.rays[pixel], nearest, light))
    shade_span_with_effects(job, materials, effects, images, pixel, pixel + 1)


@wp.func
def _start(
    view: structs.ViewArrays, poses: structs.PoseArrays, scratch: structs.Scratch, row: int
) -> structs.Job:
    return start_job(view, poses, scratch, row, row % view.cameras.shape[0], row // view.count, row)


@wp.func
def _cast_ray(job: structs.Job, pixel: int) -> tuple[float, int]:
    """Return distance and owner of the nearest surface; see `plain_kernel.find_visible`."""
    ray = job.rays[pixel]
    nearest = float(FAR_AWAY)
    owner = int(structs.NO_GEOM)
    for geom in range(job.geom_views.shape[0]):
        geom_view = job.geom_views[geom]
        into = geom_view.into @ ray
        along = float(-1.0)
        face = int(UPPER)
        if geom_view.kind == PLANE:
            along = intersect_plane(geom_view.size, geom_view.eye, into)
        else:
            along, face = intersect_solid(geom_view.kind, geom_view.size, geom_view.eye, into)
        if is_nearest(along, nearest, -ray[2], job.view.far):
            nearest = along
            owner = geom * structs.FACES + face
    return nearest, owner
