"""The ray tracer on a CPU with effects: it casts shadows; `spans_kernel` applies the others.

Solids cast shadows of the sun, the scene's first light, each within the rectangle of pixels around
it and its shadow; planes cast none. Training without effects need not compile this module.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX, PLANE, intersect_solid
from drone_rl.sim.rendering.raytrace.plain_kernel import find_visible, span_end
from drone_rl.sim.rendering.raytrace.projection_kernel import bounding_rectangle, start_job
from drone_rl.sim.rendering.raytrace.shading_kernel import shade_span_with_effects
from drone_rl.sim.rendering.raytrace.spans_kernel import fill

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

CANDIDATE = wp.constant(2)
"""Mark of a pixel that may be in shadow."""


@wp.kernel
def render_images_with_effects(
    first: int,
    last: int,
    buffer: int,
    view: structs.ViewArrays,
    geoms: structs.Geoms,
    poses: structs.PoseArrays,
    materials: structs.Materials,
    scratch: structs.Scratch,
    images: structs.Images,
    effects: structs.Effects,
) -> None:
    """Render images one after the other, as one worker; see `plain_kernel.render_images`."""
    for row in range(first, last):
        env = row // view.count
        camera = row % view.cameras.shape[0]
        render_image_with_effects(
            view, camera, geoms, poses, env, materials, scratch, buffer, images, row, effects
        )


@wp.func
def render_image_with_effects(
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
    effects: structs.Effects,
) -> None:
    """Render the image `row` of one camera of one environment."""
    count = view.height * view.width
    job = start_job(view, poses, scratch, row, camera, env, buffer)
    find_visible(job, geoms, poses)
    fill(job.dark, 0, count, 0)
    if effects.shadows[env % effects.shadows.shape[0]] != 0:
        _cast_shadows(job, materials.direction[env % materials.direction.shape[0], 0])
    start = int(0)
    while start < count:
        end = span_end(job.owner, start, count)
        shade_span_with_effects(job, materials, effects, images, start, end)
        start = end


@wp.func
def _cast_shadows(job: structs.Job, sun: wp.vec3) -> None:
    ground = find_ground(job, sun)
    for geom in range(job.geom_views.shape[0]):
        caster = job.geom_views[geom]
        if caster.kind != PLANE:
            shadow = sun * shadow_length(job, caster, ground, sun)
            part = bounding_rectangle(job, caster, shadow)
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


@wp.func
def is_shadowed(geom_view: structs.GeomView, ray: wp.vec3, distance: float, sun: wp.vec3) -> bool:
    """Return whether a geom shadows a point of another at a distance along a ray, camera frame."""
    place = geom_view.eye + distance * (geom_view.into @ ray)
    along, _face = intersect_solid(geom_view.kind, geom_view.size, place, -sun)
    return along >= 0.0


_READ = f"""
const float a = caster.into.data[0][0], b = caster.into.data[0][1], c = caster.into.data[0][2];
const float d = caster.into.data[1][0], e = caster.into.data[1][1], f = caster.into.data[1][2];
const float g = caster.into.data[2][0], h = caster.into.data[2][1], k = caster.into.data[2][2];
const float x_eye = caster.eye[0], y_eye = caster.eye[1], z_eye = caster.eye[2];
const wp::vec_t<3, float> *const seen = job.rays.data;
const float *const far = job.nearest.data;
const int *const owner = job.owner.data;
int *const hidden = job.dark.data;
const int own = geom * {structs.FACES}, next = own + {structs.FACES};
"""
"""Loads everything before the first write, which C++ must assume to alias."""
_PLACE = """
    const float u = seen[i][0], v = seen[i][1], w = seen[i][2];
    const float x = x_eye + far[i] * (a * u + b * v + c * w);
    const float y = y_eye + far[i] * (d * u + e * v + f * w);
    const float z = z_eye + far[i] * (g * u + h * v + k * w);
    const bool is_other = (owner[i] >= 0) & ((owner[i] < own) | (owner[i] >= next));
"""
"""Computes a pixel's surface point in the geom's frame, and whether it is another geom's."""


@wp.func_native(f"""
{_READ}
const float x_per = 1.0f / (wp::abs(sun[0]) < 1e-9f ? 1e-9f : sun[0]);
const float y_per = 1.0f / (wp::abs(sun[1]) < 1e-9f ? 1e-9f : sun[1]);
const float z_per = 1.0f / (wp::abs(sun[2]) < 1e-9f ? 1e-9f : sun[2]);
const float x_half = wp::abs(x_per) * caster.size[0];
const float y_half = wp::abs(y_per) * caster.size[1];
const float z_half = wp::abs(z_per) * caster.size[2];
for (int i = first; i < last; ++i) {{
    {_PLACE}
    const float x_at = x * x_per, y_at = y * y_per, z_at = z * z_per;
    float enter = x_at - x_half, leave = x_at + x_half;
    enter = enter > y_at - y_half ? enter : y_at - y_half;
    leave = leave < y_at + y_half ? leave : y_at + y_half;
    enter = enter > z_at - z_half ? enter : z_at - z_half;
    leave = leave < z_at + z_half ? leave : z_at + z_half;
    hidden[i] |= (enter >= 0.0f) & (enter <= leave) & is_other;
}}""")
def cast_box_shadow(
    job: structs.Job, first: int, last: int, geom: int, caster: structs.GeomView, sun: wp.vec3
) -> None:
    """Mark the pixels from `first` to before `last` that a box shadows, other than its own.

    `geom` is the box's index; the direction of the sunlight is in the box's frame.
    """


@wp.func_native(f"""
{_READ}
const float x_sun = sun[0], y_sun = sun[1], z_sun = sun[2];
const float speed = x_sun * x_sun + y_sun * y_sun + z_sun * z_sun;
const float reach = 1.001f * speed * wp::dot(caster.reach, caster.reach), loss = 1e-5f * speed;
for (int i = first; i < last; ++i) {{
    {_PLACE}
    const float p = y * z_sun - z * y_sun, q = z * x_sun - x * z_sun, r = x * y_sun - y * x_sun;
    const bool is_near = p * p + q * q + r * r <= reach + loss * (x * x + y * y + z * z);
    hidden[i] = ((hidden[i] == 0) & is_near & is_other) ? {CANDIDATE} : hidden[i];
}}""")
def mark_candidates(
    job: structs.Job, first: int, last: int, geom: int, caster: structs.GeomView, sun: wp.vec3
) -> None:
    """Mark pixels whose sunlight passes the bounding sphere of a solid; see `cast_box_shadow`."""


@wp.func
def find_ground(job: structs.Job, sun: wp.vec3) -> int:
    """Return the index of the plane on which all shadows end; -1 for none."""
    ground = int(-1)
    for geom in range(job.geom_views.shape[0]):
        plane = job.geom_views[geom]
        is_wide = _is_wide(plane.size[0], job.view.far) and _is_wide(plane.size[1], job.view.far)
        if plane.kind == PLANE and is_wide and wp.dot(_upright(plane), sun) < 0.0:
            ground = geom
    return ground


@wp.func
def shadow_length(job: structs.Job, caster: structs.GeomView, ground: int, sun: wp.vec3) -> float:
    """Return how far a geom's shadow can reach along the sunlight, metres."""
    if ground < 0:
        return job.view.far
    plane = job.geom_views[ground]
    up = _upright(plane)
    highest = plane.eye[2] - wp.dot(up, caster.axes @ caster.eye)
    along = wp.transpose(caster.axes) @ up
    for i in range(3):
        highest += wp.abs(along[i]) * caster.reach[i]
    return wp.max(0.0, highest) / -wp.dot(up, sun)


@wp.func
def _upright(plane: structs.GeomView) -> wp.vec3:
    return plane.axes @ wp.vec3(0.0, 0.0, 1.0)


@wp.func
def _is_wide(half: float, far: float) -> bool:
    return half == 0.0 or half >= far
