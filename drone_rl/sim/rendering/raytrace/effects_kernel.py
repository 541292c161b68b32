"""The ray tracer on a CPU with effects: sky gradient, fog, shadows and textures.

`plain_kernel.find_visible` finds the visible surfaces; then solids cast shadows, each within the
rectangle of pixels around it and its shadow; then each pixel is coloured. This is a separate module
so that training without effects need not compile it.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX, PLANE
from drone_rl.sim.rendering.raytrace.plain_kernel import find_visible, span_end, span_normal
from drone_rl.sim.rendering.raytrace.shading_kernel import (
    color_geom,
    color_sky,
    write_colors,
    write_span,
)
from drone_rl.sim.rendering.raytrace.shadows_kernel import (
    CANDIDATE,
    cast_box_shadow,
    find_ground,
    is_shadowed,
    mark_candidates,
    shadow_length,
    shadow_rectangle,
)
from drone_rl.sim.rendering.raytrace.spans_kernel import fill_floats, fill_ints

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
    effects: structs.Effects,
    scratch: structs.Scratch,
    images: structs.Images,
) -> None:
    """Render images one after the other, as one worker; see `plain_kernel.render_images`."""
    for row in range(first, last):
        world = row // view.count
        number = row % view.cameras.shape[0]
        find_visible(view, number, geoms, poses, world, scratch, member)
        fill_ints(scratch.dark[member], 0, view.height * view.width, 0)
        if effects.shadows[world % effects.shadows.shape[0]] != 0:
            sun = materials.direction[world % materials.direction.shape[0], 0]
            _cast_shadows(view, number, sun, scratch, member)
        _shade(view, number, poses, materials, effects, world, row, scratch, member, images)


@wp.func
def _cast_shadows(
    view: structs.View, number: int, sun: wp.vec3, scratch: structs.Scratch, member: int
) -> None:
    """Mark the pixels of a camera that are in shadow."""
    camera, rays, geom_views = view.cameras[number], view.rays[number], scratch.geom_views[member]
    nearest, owners, dark = scratch.nearest[member], scratch.owner[member], scratch.dark[member]
    ground = find_ground(view, geom_views, sun)
    for geom in range(geom_views.shape[0]):
        if geom_views[geom].kind != PLANE:
            caster = geom_views[geom]
            way = sun * shadow_length(view, geom_views, geom, ground, sun)
            part = shadow_rectangle(view, camera, caster, way)
            light = wp.transpose(caster.axes) @ sun
            row = part[2]
            while row < part[3]:
                first, last = row * view.width + part[0], row * view.width + part[1]
                if caster.kind == BOX:
                    cast_box_shadow(
                        dark, first, last, rays, nearest, owners, structs.FACES, geom, caster, light
                    )
                else:
                    _cast_shadow(dark, first, last, rays, nearest, owners, geom, caster, light)
                row += 1


@wp.func
def _cast_shadow(
    dark: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    owners: wp.array[int],
    geom: int,
    caster: structs.GeomView,
    light: wp.vec3,
) -> None:
    """`cast_box_shadow` for any solid."""
    mark_candidates(
        dark, first, last, rays, nearest, owners, structs.FACES, geom, caster, light, CANDIDATE
    )
    pixel = first
    while pixel < last:
        if dark[pixel] == CANDIDATE:
            dark[pixel] = int(is_shadowed(caster, rays[pixel], nearest[pixel], light))
        pixel += 1


@wp.func
def _shade(
    view: structs.View,
    number: int,
    poses: structs.Poses,
    materials: structs.Materials,
    effects: structs.Effects,
    world: int,
    row: int,
    scratch: structs.Scratch,
    member: int,
    images: structs.Images,
) -> None:
    camera, rays, cosines = view.cameras[number], view.rays[number], view.cosines[number]
    nearest, owners, dark = scratch.nearest[member], scratch.owner[member], scratch.dark[member]
    colors = scratch.colors[member]
    count = view.height * view.width
    first = int(0)
    while first < count:
        owner = owners[first]
        last = span_end(owners, first, count)
        shown = structs.PixelValue()
        shown.number = structs.NO_GEOM
        if owner == structs.NO_GEOM:
            fill_floats(nearest, first, last, 0.0)
            color_sky(colors, first, last, rays, camera, poses, materials, effects, world)
        else:
            geom_view = scratch.geom_views[member, owner // structs.FACES]
            normal = span_normal(geom_view, owner, rays[first], nearest[first])
            shown.number = geom_view.number
            shown.normal = geom_view.axes @ normal
            color_geom(
                colors,
                first,
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
                owner % structs.FACES,
                normal,
            )
        write_span(
            images,
            view.what & ~(structs.RGB | structs.GRAY),
            row,
            first,
            last,
            shown,
            nearest,
            cosines,
        )
        first = last
    write_colors(images, view.what, row, 0, count, colors)
