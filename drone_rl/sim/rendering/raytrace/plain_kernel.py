"""The ray tracer on a CPU, for flat colors and light: one image at a time, geom by geom.

Rays are cast at each geom, in the geom's own frame, within the rectangle of pixels around its
projection; the nearest hit owns the pixel. Then pixels are shaded, once for a span of consecutive
pixels, also across rows, that show the same flat face or the sky. Warp's `for` loops are several
times as slow as `while` on a CPU.
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
)
from drone_rl.sim.rendering.raytrace.projection_kernel import (
    bounding_rectangle,
    start_job,
    view_geom,
)
from drone_rl.sim.rendering.raytrace.shading_kernel import shade_span
from drone_rl.sim.rendering.raytrace.spans_kernel import fill, intersect_level_plane

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def render_images(
    first: int,
    last: int,
    buffer: int,
    view: structs.ViewArrays,
    geoms: structs.Geoms,
    poses: structs.PoseArrays,
    materials: structs.Materials,
    scratch: structs.Scratch,
    images: structs.Images,
) -> None:
    """Render images from `first` up to, not including, `last`, with row `buffer` of `Scratch`.

    Launch it with a dimension of 1.
    """
    for row in range(first, last):
        env = row // view.count
        camera = row % view.cameras.shape[0]  # of each environment, or of all
        render_image(view, camera, geoms, poses, env, materials, scratch, buffer, images, row)


@wp.func
def render_image(
    view: structs.ViewArrays,
    camera: int,
    geoms: structs.Geoms,
    poses: structs.PoseArrays,
    env: int,
    materials: structs.Materials,
    scratch: structs.Scratch,
    buffer: int,
    images: structs.Images,
    row: int,
) -> None:
    """Render the image `row` of one camera of one environment; see `render_images`."""
    job = start_job(view, poses, scratch, row, camera, env, buffer)
    find_visible(job, geoms, poses)
    count = view.height * view.width
    start = int(0)
    while start < count:
        end = span_end(job.owner, start, count)
        shade_span(job, materials, images, start, end, job.owner[start], job.nearest[start])
        start = end


@wp.func
def find_visible(job: structs.Job, geoms: structs.Geoms, poses: structs.PoseArrays) -> None:
    """Find the nearest surface of each pixel: write `nearest` and `owner`."""
    count = job.view.height * job.view.width
    fill(job.nearest, 0, count, FAR_AWAY)
    fill(job.owner, 0, count, structs.NO_GEOM)
    for geom in range(geoms.kind.shape[0]):
        geom_view = view_geom(job, geoms, geom, poses)
        job.geom_views[geom] = geom_view
        if geom_view.kind == PLANE:
            _find_plane(job, geom_view, geom)
        else:
            _find_solid(job, geom_view, geom)


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
def _find_plane(job: structs.Job, geom_view: structs.GeomView, geom: int) -> None:
    """Skip rows above its horizon; if both ends of a row hit, so does all between."""
    rays, nearest, owner = job.rays, job.nearest, job.owner
    mark = geom * structs.FACES + UPPER
    width, far = job.view.width, job.view.far
    start = int(0)
    while start < job.view.height * width:
        end = start + width
        leftmost, rightmost = rays[start], rays[end - 1]
        left, right = geom_view.into @ leftmost, geom_view.into @ rightmost
        if left[2] < 0.0 or right[2] < 0.0:
            pixel = start
            if _hits(far, geom_view, leftmost, left) and _hits(far, geom_view, rightmost, right):
                down, below = geom_view.into[2], -geom_view.eye[2]
                intersect_level_plane(nearest, owner, start, end, rays, down, below, SAME, mark)
                pixel = end
            while pixel < end:
                ray = rays[pixel]
                along = intersect_plane(geom_view.size, geom_view.eye, geom_view.into @ ray)
                if is_nearest(along, nearest[pixel], -ray[2], far):
                    nearest[pixel] = along
                    owner[pixel] = mark
                pixel += 1
        start = end


@wp.func
def _hits(far: float, geom_view: structs.GeomView, ray: wp.vec3, into: wp.vec3) -> bool:
    along = intersect_plane(geom_view.size, geom_view.eye, into)
    return along >= 0.0 and along * -ray[2] <= far


@wp.func
def _find_solid(job: structs.Job, geom_view: structs.GeomView, geom: int) -> None:
    rays, nearest, owner = job.rays, job.nearest, job.owner
    width, far = job.view.width, job.view.far
    part = bounding_rectangle(job, geom_view, wp.vec3())
    row = part[2]
    while row < part[3]:
        pixel = row * width + part[0]
        end = row * width + part[1]
        while pixel < end:
            ray = rays[pixel]
            into = geom_view.into @ ray
            along, face = intersect_solid(geom_view.kind, geom_view.size, geom_view.eye, into)
            if is_nearest(along, nearest[pixel], -ray[2], far):
                nearest[pixel] = along
                owner[pixel] = geom * structs.FACES + face
            pixel += 1
        row += 1
