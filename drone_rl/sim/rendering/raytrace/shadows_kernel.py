"""Shadows: which points a solid keeps from the sun, and which pixels can show that.

The sun is the scene's first light. Planes cast no shadows, since they are visible from one side.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import FAR_AWAY, PLANE, intersect_solid
from drone_rl.sim.rendering.raytrace.projection_kernel import IN_FRONT, pixel_rectangle
from drone_rl.sim.rendering.raytrace.structs_kernel import Camera, GeomView, View


@wp.func
def is_shadowed(geom_view: GeomView, ray: wp.vec3, distance: float, sun: wp.vec3) -> bool:
    """Return whether a geom shadows a point that is not on it.

    Args:
        geom_view: The geom.
        ray: Of the point, in the camera's frame.
        distance: Of the point along the ray.
        sun: Direction of the sunlight, in the geom's frame.
    """
    place = geom_view.eye + distance * (geom_view.into @ ray)
    along, _face = intersect_solid(geom_view.kind, geom_view.size, place, -sun)
    return along >= 0.0


_READ = """
const float a = caster.into.data[0][0], b = caster.into.data[0][1], c = caster.into.data[0][2];
const float d = caster.into.data[1][0], e = caster.into.data[1][1], f = caster.into.data[1][2];
const float g = caster.into.data[2][0], h = caster.into.data[2][1], k = caster.into.data[2][2];
const float x_eye = caster.eye[0], y_eye = caster.eye[1], z_eye = caster.eye[2];
const wp::vec_t<3, float> *const seen = rays.data;
const float *const far = nearest.data;
const int *const owner = owners.data;
int *const hidden = dark.data;
const int own = geom * faces, next = own + faces;
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
    dark: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    owners: wp.array[int],
    faces: int,
    geom: int,
    caster: GeomView,
    sun: wp.vec3,
) -> None:
    """Set `dark` to 1 for the pixels of a span that a box shadows; see `spans_kernel`.

    Args:
        dark: Written.
        first: First pixel.
        last: One past the last pixel.
        rays: Of the pixels.
        nearest: Distance of each visible surface.
        owners: See `Scratch.owner`.
        faces: `FACES`.
        geom: Index of the caster, which does not shadow itself.
        caster: The box.
        sun: Direction of the sunlight, in the box's frame.
    """


CANDIDATE = wp.constant(2)
"""Mark of a pixel that may be in shadow."""


@wp.func_native(f"""
{_READ}
const float x_sun = sun[0], y_sun = sun[1], z_sun = sun[2];
const float speed = x_sun * x_sun + y_sun * y_sun + z_sun * z_sun;
const float reach = 1.001f * speed * wp::dot(caster.reach, caster.reach), loss = 1e-5f * speed;
for (int i = first; i < last; ++i) {{
    {_PLACE}
    const float p = y * z_sun - z * y_sun, q = z * x_sun - x * z_sun, r = x * y_sun - y * x_sun;
    const bool is_near = p * p + q * q + r * r <= reach + loss * (x * x + y * y + z * z);
    hidden[i] = ((hidden[i] == 0) & is_near & is_other) ? maybe : hidden[i];
}}""")
def mark_candidates(
    dark: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    owners: wp.array[int],
    faces: int,
    geom: int,
    caster: GeomView,
    sun: wp.vec3,
    maybe: int,
) -> None:
    """Mark pixels whose sunlight passes the bounding sphere of a solid; see `cast_box_shadow`."""


@wp.func
def find_ground(view: View, geom_views: wp.array[GeomView], sun: wp.vec3) -> int:
    """Return the index of the plane on which all shadows end; -1 for none."""
    ground = int(-1)
    for geom in range(geom_views.shape[0]):
        if geom_views[geom].kind == PLANE:
            geom_view = geom_views[geom]
            is_wide = _is_wide(geom_view.size[0], view.far) and _is_wide(
                geom_view.size[1], view.far
            )
            if is_wide and wp.dot(_upright(geom_view), sun) < 0.0:
                ground = geom
    return ground


@wp.func
def shadow_length(
    view: View, geom_views: wp.array[GeomView], geom: int, ground: int, sun: wp.vec3
) -> float:
    """Return how far a geom's shadow can reach along the sunlight, metres."""
    if ground < 0:
        return view.far
    caster, plane = geom_views[geom], geom_views[ground]
    up = _upright(plane)
    highest = plane.eye[2] - wp.dot(up, caster.axes @ caster.eye)
    along = wp.transpose(caster.axes) @ up
    for i in range(3):
        highest += wp.abs(along[i]) * caster.reach[i]
    return wp.max(0.0, highest) / -wp.dot(up, sun)


@wp.func
def shadow_rectangle(view: View, camera: Camera, geom_view: GeomView, way: wp.vec3) -> wp.vec4i:
    """Return the pixels that can show a geom or its shadow, which ends `way` (world frame) away."""
    back = wp.transpose(geom_view.into)
    centre = -(back @ geom_view.eye)
    swept = back @ (wp.transpose(geom_view.axes) @ way)
    sides = wp.matrix_from_cols(
        back @ wp.vec3(geom_view.reach[0], 0.0, 0.0),
        back @ wp.vec3(0.0, geom_view.reach[1], 0.0),
        back @ wp.vec3(0.0, 0.0, geom_view.reach[2]),
    )
    lowest = wp.vec2(FAR_AWAY, FAR_AWAY)
    highest = wp.vec2(-FAR_AWAY, -FAR_AWAY)
    behind = int(0)
    for corner in range(16):
        at = _corner(corner, centre, sides, swept)
        if -at[2] < IN_FRONT:
            behind += 1 << corner
        else:
            seen = wp.vec2(at[0] / -at[2], -at[1] / -at[2])
            lowest = wp.min(lowest, seen)
            highest = wp.max(highest, seen)
    if behind == 65535:
        return wp.vec4i(0, 0, 0, 0)
    if behind > 0:
        for edge in range(64):  # as in `bounding_rectangle`, of a swept box
            one, other = edge // 4, (edge // 4) ^ (1 << (edge % 4))
            if ((behind >> one) & 1) == 0 and ((behind >> other) & 1) == 1:
                at = _corner(one, centre, sides, swept)
                hidden = _corner(other, centre, sides, swept)
                at += (at[2] + IN_FRONT) / (at[2] - hidden[2]) * (hidden - at)
                seen = wp.vec2(at[0], -at[1]) / IN_FRONT
                lowest = wp.min(lowest, seen)
                highest = wp.max(highest, seen)
    return pixel_rectangle(view, camera, lowest, highest)


@wp.func
def _corner(corner: int, centre: wp.vec3, sides: wp.mat33, swept: wp.vec3) -> wp.vec3:
    """A corner of a box (bits 0 to 2), moved to the shadow's end (bit 3), camera frame."""
    signs = wp.vec3(
        float(corner & 1) * 2.0 - 1.0,
        float((corner >> 1) & 1) * 2.0 - 1.0,
        float((corner >> 2) & 1) * 2.0 - 1.0,
    )
    return centre + sides @ signs + float(corner >> 3) * swept


@wp.func
def _upright(plane: GeomView) -> wp.vec3:
    """A plane's normal, world frame."""
    return plane.axes @ wp.vec3(0.0, 0.0, 1.0)


@wp.func
def _is_wide(half: float, far: float) -> bool:
    return half == 0.0 or half >= far
