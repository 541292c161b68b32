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
"""Shadows of the sun: where solids stand in its way, and which pixels can show that.

Planes cast none, as they are seen from one side alone. The sun is a scene's first light.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import FAR_AWAY, PLANE, enter
from drone_rl.sim.rendering.raytrace.projection_kernel import IN_FRONT, rectangle
from drone_rl.sim.rendering.raytrace.structs_kernel import Camera, Sight, View


@wp.func
def is_behind(sight: Sight, ray: wp.vec3, distance: float, sun: wp.vec3) -> bool:
    """Whether a geom keeps the sun from a place.

    Args:
        sight: The geom; not the one that the place is on.
        ray: Of the camera, in the camera's frame, on which the place is.
        distance: Along it.
        sun: Where the sun's light goes, in the geom's frame.
    """
    place = sight.eye + distance * (sight.into @ ray)
    along, _face = enter(sight.kind, sight.size, place, -sun)
    return along >= 0.0


_READ = """
const float a = sight.into.data[0][0], b = sight.into.data[0][1], c = sight.into.data[0][2];
const float d = sight.into.data[1][0], e = sight.into.data[1][1], f = sight.into.data[1][2];
const float g = sight.into.data[2][0], h = sight.into.data[2][1], k = sight.into.data[2][2];
const float x_eye = sight.eye[0], y_eye = sight.eye[1], z_eye = sight.eye[2];
const wp::vec_t<3, float> *const seen = rays.data;
const float *const far = nearest.data;
const int *const owner = owners.data;
int *const hidden = dark.data;
const int own = geom * faces, next = own + faces;
"""
"""Before anything is written, which C++ takes for possibly the same memory."""
_PLACE = """
    const float u = seen[i][0], v = seen[i][1], w = seen[i][2];
    const float x = x_eye + far[i] * (a * u + b * v + c * w);
    const float y = y_eye + far[i] * (d * u + e * v + f * w);
    const float z = z_eye + far[i] * (g * u + h * v + k * w);
    const bool is_other = (owner[i] >= 0) & ((owner[i] < own) | (owner[i] >= next));
"""
"""Of a pixel, in the geom's frame, and whether somebody else is seen there."""


@wp.func_native(f"""
{_READ}
const float x_per = 1.0f / (wp::abs(sun[0]) < 1e-9f ? 1e-9f : sun[0]);
const float y_per = 1.0f / (wp::abs(sun[1]) < 1e-9f ? 1e-9f : sun[1]);
const float z_per = 1.0f / (wp::abs(sun[2]) < 1e-9f ? 1e-9f : sun[2]);
const float x_half = wp::abs(x_per) * sight.size[0];
const float y_half = wp::abs(y_per) * sight.size[1];
const float z_half = wp::abs(z_per) * sight.size[2];
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
def hide_by_box(
    dark: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    owners: wp.array[int],
    faces: int,
    geom: int,
    sight: Sight,
    sun: wp.vec3,
) -> None:
    """Marks the pixels in a row from which a box keeps the sun.

    Args:
        dark: Is written.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        nearest: How far along its ray each surface is.
        owners: Whose it is: so many times the geom, and the face; negative for the sky.
        faces: How many times.
        geom: The box, which is not in its own way.
        sight: The same.
        sun: Where the sun's light goes, in the box's frame.
    """
    ...


MAYBE = wp.constant(2)
"""What a pixel is marked with whose place may be in a geom's shadow."""


@wp.func_native(f"""
{_READ}
const float x_sun = sun[0], y_sun = sun[1], z_sun = sun[2];
const float speed = x_sun * x_sun + y_sun * y_sun + z_sun * z_sun;
const float reach = 1.001f * speed * wp::dot(sight.reach, sight.reach), loss = 1e-5f * speed;
for (int i = first; i < last; ++i) {{
    {_PLACE}
    const float p = y * z_sun - z * y_sun, q = z * x_sun - x * z_sun, r = x * y_sun - y * x_sun;
    const bool is_near = p * p + q * q + r * r <= reach + loss * (x * x + y * y + z * z);
    hidden[i] = ((hidden[i] == 0) & is_near & is_other) ? maybe : hidden[i];
}}""")
def mark_near(
    dark: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    owners: wp.array[int],
    faces: int,
    geom: int,
    sight: Sight,
    sun: wp.vec3,
    maybe: int,
) -> None:
    """Marks the pixels in a row from which the sun's light passes the ball around a geom.

    Args:
        dark: Is written where it is 0; see `hide_by_box`, as what is not told here.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        nearest: How far along its ray each surface is.
        owners: Whose it is.
        faces: How many times.
        geom: Whose ball.
        sight: The same.
        sun: Where the sun's light goes, in the geom's frame.
        maybe: The mark.
    """
    ...


@wp.func
def find_ground(view: View, sights: wp.array[Sight], sun: wp.vec3) -> int:
    """The plane on which all shadows end; -1 for none."""
    ground = int(-1)
    for geom in range(sights.shape[0]):
        if sights[geom].kind == PLANE:
            sight = sights[geom]
            is_wide = _is_wide(sight.size[0], view.far) and _is_wide(sight.size[1], view.far)
            if is_wide and wp.dot(_upright(sight), sun) < 0.0:
                ground = geom
    return ground


@wp.func
def shadow_length(
    view: View, sights: wp.array[Sight], geom: int, ground: int, sun: wp.vec3
) -> float:
    """How far along the sun's light the shadow of a geom must be looked for, in metres."""
    if ground < 0:
        return view.far
    caster, plane = sights[geom], sights[ground]
    up = _upright(plane)
    highest = plane.eye[2] - wp.dot(up, caster.axes @ caster.eye)
    along = wp.transpose(caster.axes) @ up
    for i in range(3):
        highest += wp.abs(along[i]) * caster.reach[i]
    return wp.max(0.0, highest) / -wp.dot(up, sun)


@wp.func
def around_shadow(view: View, camera: Camera, sight: Sight, way: wp.vec3) -> wp.vec4i:
    """Columns and rows, from and to, outside which no ray meets a geom or its shadow.

    Args:
        view: Whose pixels.
        camera: Who looks.
        sight: The geom.
        way: From the geom to where its shadow ends, world frame.
    """
    back = wp.transpose(sight.into)
    centre = -(back @ sight.eye)
    swept = back @ (wp.transpose(sight.axes) @ way)
    sides = wp.matrix_from_cols(
        back @ wp.vec3(sight.reach[0], 0.0, 0.0),
        back @ wp.vec3(0.0, sight.reach[1], 0.0),
        back @ wp.vec3(0.0, 0.0, sight.reach[2]),
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
        for edge in range(64):  # as in `around`, of a box that has been drawn out
            one, other = edge // 4, (edge // 4) ^ (1 << (edge % 4))
            if ((behind >> one) & 1) == 0 and ((behind >> other) & 1) == 1:
                at = _corner(one, centre, sides, swept)
                hidden = _corner(other, centre, sides, swept)
                at += (at[2] + IN_FRONT) / (at[2] - hidden[2]) * (hidden - at)
                seen = wp.vec2(at[0], -at[1]) / IN_FRONT
                lowest = wp.min(lowest, seen)
                highest = wp.max(highest, seen)
    return rectangle(view, camera, lowest, highest)


@wp.func
def _corner(corner: int, centre: wp.vec3, sides: wp.mat33, swept: wp.vec3) -> wp.vec3:
    """Of a box, bits 0 to 2, here or where its shadow ends, bit 3; in the camera's frame."""
    signs = wp.vec3(
        float(corner & 1) * 2.0 - 1.0,
        float((corner >> 1) & 1) * 2.0 - 1.0,
        float((corner >> 2) & 1) * 2.0 - 1.0,
    )
    return centre + sides @ signs + float(corner >> 3) * swept


@wp.func
def _upright(plane: Sight) -> wp.vec3:
    """A plane's normal, world frame."""
    return plane.axes @ wp.vec3(0.0, 0.0, 1.0)


@wp.func
def _is_wide(half: float, far: float) -> bool:
    return half == 0.0 or half >= far
