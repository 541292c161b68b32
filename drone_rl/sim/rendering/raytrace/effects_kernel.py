"""The ray tracer on a CPU with effects: sky gradient, fog, shadows and textures.

`plain_kernel.find_visible` finds the visible surfaces; then solids cast shadows, each within the
rectangle of pixels around it and its shadow; then each pixel is coloured. This is a separate module
so that training without effects need not compile it.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX, PLANE
from drone_rl.sim.rendering.raytrace.plain_kernel import find_visible, span_end
from drone_rl.sim.rendering.raytrace.projection_kernel import bounding_rectangle, start_job
from drone_rl.sim.rendering.raytrace.shading_kernel import shade_span_with_effects
from drone_rl.sim.rendering.raytrace.shadows_kernel import (
    CANDIDATE,
    cast_box_shadow,
    find_ground,
    is_shadowed,
    mark_candidates,
    shadow_length,
)
from drone_rl.sim.rendering.raytrace.spans_kernel import fill

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def render_images_with_effects(
    first: int,
    last: int,
    member: int,
    view: structs.View,
    geoms: structs.Geoms,
    poses: structs.Poses,
    materials: structs.Materials,
    scratch: structs.Scratch,
    images: structs.Images,
    effects: structs.Effects,
) -> None:
    """Render images one after the other, as one worker; see `plain_kernel.render_images`."""
    count = view.height * view.width
    for row in range(first, last):
        world = row // view.count
        job = start_job(view, poses, scratch, row, row % view.cameras.shape[0], world, member)
        find_visible(job, geoms, poses)
        fill(job.dark, 0, count, 0)
        if effects.shadows[world % effects.shadows.shape[0]] != 0:
            _cast_shadows(job, materials.direction[world % materials.direction.shape[0], 0])
        start = int(0)
        while start < count:
            end = span_end(job.owner, start, count)
            shade_span_with_effects(job, materials, effects, images, start, end)
            start = end


@wp.func
def _cast_shadows(job: structs.Job, sun: wp.vec3) -> None:
    """Mark the pixels that are in shadow."""
    ground = find_ground(job, sun)
    for geom in range(job.geom_views.shape[0]):
        caster = job.geom_views[geom]
        if caster.kind != PLANE:
            way = sun * shadow_length(job, caster, ground, sun)
            part = bounding_rectangle(job, caster, way)
            light = wp.transpose(caster.axes) @ sun
            row = part[2]
            while row < part[3]:
                first, last = row * job.view.width + part[0], row * job.view.width + part[1]
                if caster.kind == BOX:
                    cast_box_shadow(job, first, last, geom, caster, light)
                else:
                    _cast_shadow(job, first, last, geom, caster, light)
                row += 1


@wp.func
def _cast_shadow(
    job: structs.Job, first: int, last: int, geom: int, caster: structs.GeomView, light: wp.vec3
) -> None:
    """`cast_box_shadow` for any solid."""
    mark_candidates(job, first, last, geom, caster, light)
    dark, rays, nearest = job.dark, job.rays, job.nearest
    pixel = first
    while pixel < last:
        if dark[pixel] == CANDIDATE:
            dark[pixel] = int(is_shadowed(caster, rays[pixel], nearest[pixel], light))
        pixel += 1
