"""The ray tracer on a CPU, for flat colours and light: one image at a time, geom by geom.

`find_visible` takes the geoms in order and casts rays at each, in the geom's own frame, within the
rectangle of pixels around its projection; the nearest hit owns the pixel. Then pixels are shaded,
once for a span of pixels in a row that show the same flat face.

Pixels are counted by `while`: Warp's code of a `for` loop is several times as slow on a CPU.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    FAR_AWAY,
    PLANE,
    ROUND,
    SAME,
    UPPER,
    intersect_plane,
    intersect_solid,
    is_nearest,
    surface_normal,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import (
    bounding_rectangle,
    camera_pose,
    view_geom,
)
from drone_rl.sim.rendering.raytrace.shading_kernel import geom_pixel, sky_pixel, write_span
from drone_rl.sim.rendering.raytrace.spans_kernel import (
    fill_floats,
    fill_ints,
    intersect_level_plane,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def render_images(
    first: int,
    last: int,
    member: int,
    view: structs.View,
    geoms: structs.Geoms,
    poses: structs.Poses,
    materials: structs.Materials,
    scratch: structs.Scratch,
    images: structs.Images,
) -> None:
    """Render images one after the other, as one worker: launch it with a dimension of 1.

    Args:
        first: The first image.
        last: One past the last image.
        member: Which of the scratch buffers to use.
        view: What to render.
        geoms: Of the scene.
        poses: Of all environments.
        materials: Colours and light.
        scratch: Buffers of all workers.
        images: Written.
    """
    for row in range(first, last):
        world = row // view.count
        camera = row % view.cameras.shape[0]
        render_image(view, camera, geoms, poses, world, materials, scratch, member, images, row)


@wp.func
def render_image(
    view: structs.View,
    camera: int,
    geoms: structs.Geoms,
    poses: structs.Poses,
    world: int,
    materials: structs.Materials,
    scratch: structs.Scratch,
    member: int,
    images: structs.Images,
    row: int,
) -> None:
    """Render the image `row` of one camera of one environment; see `render_images`."""
    find_visible(view, camera, geoms, poses, world, scratch, member)
    nearest, owners = scratch.nearest[member], scratch.owner[member]
    geom_views, rays, cosines = scratch.geom_views[member], view.rays[camera], view.cosines[camera]
    count = view.height * view.width
    start = int(0)
    while start < count:
        owner = owners[start]
        end = span_end(owners, start, count)
        shown = sky_pixel(materials, world)
        if owner == structs.NO_GEOM:
            fill_floats(nearest, start, end, 0.0)
        else:
            geom_view = geom_views[owner // structs.FACES]
            normal = span_normal(geom_view, owner, rays[start], nearest[start])
            shown = geom_pixel(materials, world, geom_view.number, geom_view.axes @ normal)
        write_span(images, view.what, row, start, end, shown, nearest, cosines)
        start = end


@wp.func
def find_visible(
    view: structs.View,
    camera: int,
    geoms: structs.Geoms,
    poses: structs.Poses,
    world: int,
    scratch: structs.Scratch,
    member: int,
) -> None:
    """Find the nearest surface of each pixel, and leave it in `scratch`."""
    nearest = scratch.nearest[member]
    owner = scratch.owner[member]
    geom_views = scratch.geom_views[member]
    rays = view.rays[camera]
    fill_floats(nearest, 0, view.height * view.width, FAR_AWAY)
    fill_ints(owner, 0, view.height * view.width, structs.NO_GEOM)
    pose = camera_pose(view.cameras[camera], poses, world)
    for geom in range(geoms.kind.shape[0]):
        geom_view = view_geom(geoms, geom, poses, world, pose)
        geom_views[geom] = geom_view
        if geom_view.kind == PLANE:
            _find_plane(view, rays, geom_view, geom, nearest, owner)
        else:
            part = bounding_rectangle(view, view.cameras[camera], geom_view)
            _find_solid(view, part, rays, geom_view, geom, nearest, owner)


@wp.func
def span_end(owners: wp.array[int], start: int, count: int) -> int:
    """Return the end of a span of one flat face or the sky; a round face's span is one pixel."""
    owner = owners[start]
    end = start + 1
    if owner == structs.NO_GEOM or owner % structs.FACES != ROUND:
        while end < count and owners[end] == owner:
            end += 1
    return end


@wp.func
def span_normal(geom_view: structs.GeomView, owner: int, ray: wp.vec3, distance: float) -> wp.vec3:
    """Return the normal of a span's first pixel, in the geom's frame."""
    into = geom_view.into @ ray
    kind, size, eye = geom_view.kind, geom_view.size, geom_view.eye
    return surface_normal(kind, size, owner % structs.FACES, eye, into, distance)


@wp.func
def _find_plane(
    view: structs.View,
    rays: wp.array[wp.vec3],
    geom_view: structs.GeomView,
    geom: int,
    nearest: wp.array[float],
    owner: wp.array[int],
) -> None:
    """Only rows that end below its horizon; if both ends of a row hit, so does all between."""
    mark = geom * structs.FACES + UPPER
    start = int(0)
    while start < view.height * view.width:
        end = start + view.width
        left = geom_view.into @ rays[start]
        right = geom_view.into @ rays[end - 1]
        if left[2] < 0.0 or right[2] < 0.0:
            pixel = start
            leftmost, rightmost = rays[start], rays[end - 1]
            if _hits(view, geom_view, leftmost, left) and _hits(view, geom_view, rightmost, right):
                down, height = geom_view.into[2], -geom_view.eye[2]
                intersect_level_plane(nearest, owner, start, end, rays, down, height, SAME, mark)
                pixel = end
            while pixel < end:
                ray = rays[pixel]
                along = intersect_plane(geom_view.size, geom_view.eye, geom_view.into @ ray)
                if is_nearest(along, nearest[pixel], -ray[2], view.far):
                    nearest[pixel] = along
                    owner[pixel] = mark
                pixel += 1
        start = end


@wp.func
def _hits(view: structs.View, geom_view: structs.GeomView, ray: wp.vec3, into: wp.vec3) -> bool:
    along = intersect_plane(geom_view.size, geom_view.eye, into)
    return along >= 0.0 and along * -ray[2] <= view.far


@wp.func
def _find_solid(
    view: structs.View,
    part: wp.vec4i,
    rays: wp.array[wp.vec3],
    geom_view: structs.GeomView,
    geom: int,
    nearest: wp.array[float],
    owner: wp.array[int],
) -> None:
    row = part[2]
    while row < part[3]:
        pixel = row * view.width + part[0]
        end = row * view.width + part[1]
        while pixel < end:
            ray = rays[pixel]
            into = geom_view.into @ ray
            along, face = intersect_solid(geom_view.kind, geom_view.size, geom_view.eye, into)
            if is_nearest(along, nearest[pixel], -ray[2], view.far):
                nearest[pixel] = along
                owner[pixel] = geom * structs.FACES + face
            pixel += 1
        row += 1
