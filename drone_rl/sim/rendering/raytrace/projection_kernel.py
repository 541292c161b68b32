# ruff: noqa: RUF046, UP018
# pyright: reportIndexIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles this file; Python's types say nothing about it, and what a loop changes is
# declared by its type.)
"""Where a geom is for a camera, and which pixels can show it."""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import FAR_AWAY
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    DRONE_FRAME,
    Camera,
    Geoms,
    Poses,
    Sight,
    View,
)

IN_FRONT = wp.constant(1e-3)
"""Metres before the camera from which corners are projected."""


@wp.struct
class Stand:
    """Where a camera is, world frame."""

    eye: wp.vec3
    looking: wp.mat33
    """From the camera's frame."""


@wp.func
def stand(camera: Camera, poses: Poses, world: int) -> Stand:
    """Where a camera of a world is."""
    turned = _frame_attitude(camera.frame, poses.attitudes[world])
    found = Stand()
    found.eye = poses.places[world, camera.frame] + _rotation(turned) @ camera.position
    found.looking = _rotation(_product(turned, camera.attitude))
    return found


@wp.func
def look_at(geoms: Geoms, geom: int, poses: Poses, world: int, there: Stand) -> Sight:
    """A geom of a world, seen by a camera."""
    frame = geoms.frame[geom]
    turned = _frame_attitude(frame, poses.attitudes[world])
    centre = poses.places[world, frame] + _rotation(turned) @ geoms.position[geom]
    sight = Sight()
    sight.kind = geoms.kind[geom]
    sight.number = geoms.number[geom]
    sight.size = geoms.size[geom]
    sight.reach = geoms.reach[geom]
    if poses.scales:
        sight.size *= poses.scales[world, frame]
        sight.reach *= poses.scales[world, frame]
    sight.axes = _rotation(_product(turned, geoms.attitude[geom]))
    sight.eye = wp.transpose(sight.axes) @ (there.eye - centre)
    sight.into = wp.transpose(sight.axes) @ there.looking
    return sight


@wp.func
def upward(camera: Camera, poses: Poses, world: int) -> wp.vec3:
    """What a ray of a camera is multiplied by to find how far it goes up."""
    turned = _frame_attitude(camera.frame, poses.attitudes[world])
    return wp.transpose(_rotation(_product(turned, camera.attitude))) @ wp.vec3(0.0, 0.0, 1.0)


@wp.func
def around(view: View, camera: Camera, sight: Sight) -> wp.vec4i:
    """Columns and rows, from and to, outside which no ray meets a geom."""
    lowest = wp.vec2(FAR_AWAY, FAR_AWAY)
    highest = wp.vec2(-FAR_AWAY, -FAR_AWAY)
    behind = int(0)
    for corner in range(8):
        at = _corner(sight, corner)
        if -at[2] < IN_FRONT:
            behind += 1 << corner
        else:
            seen = wp.vec2(at[0] / -at[2], -at[1] / -at[2])
            lowest = wp.min(lowest, seen)
            highest = wp.max(highest, seen)
    if behind == 255:
        return wp.vec4i(0, 0, 0, 0)
    if behind > 0:
        for edge in range(24):  # where those that lead behind the camera leave the picture
            one, other = edge // 3, (edge // 3) ^ (1 << (edge % 3))
            if ((behind >> one) & 1) == 0 and ((behind >> other) & 1) == 1:
                at, back = _corner(sight, one), _corner(sight, other)
                at += (at[2] + IN_FRONT) / (at[2] - back[2]) * (back - at)
                seen = wp.vec2(at[0], -at[1]) / IN_FRONT
                lowest = wp.min(lowest, seen)
                highest = wp.max(highest, seen)
    return rectangle(view, camera, lowest, highest)


@wp.func
def _corner(sight: Sight, corner: int) -> wp.vec3:
    """Of the box around a geom, in the camera's frame."""
    sides = wp.vec3(
        float(corner & 1) * 2.0 - 1.0,
        float((corner >> 1) & 1) * 2.0 - 1.0,
        float((corner >> 2) & 1) * 2.0 - 1.0,
    )
    return wp.transpose(sight.into) @ (wp.cw_mul(sides, sight.reach) - sight.eye)


@wp.func
def rectangle(view: View, camera: Camera, lowest: wp.vec2, highest: wp.vec2) -> wp.vec4i:
    """Columns and rows, from and to, that can show what lies between two places.

    Args:
        view: Whose pixels.
        camera: Who looks.
        lowest: To the right and downwards, at a distance of 1.
        highest: The other end.
    """
    return wp.vec4i(
        _first_pixel(lowest[0], camera.half_width, view.width),
        wp.min(_first_pixel(highest[0], camera.half_width, view.width) + 3, view.width),
        _first_pixel(lowest[1], camera.half_height, view.height),
        wp.min(_first_pixel(highest[1], camera.half_height, view.height) + 3, view.height),
    )


@wp.func
def _first_pixel(place: float, half: float, count: int) -> int:
    """The first pixel that can show a place, given along an axis at a distance of 1."""
    pixel = (place / half + 1.0) * 0.5 * float(count) - 1.5
    return int(wp.clamp(wp.floor(pixel), 0.0, float(count)))


@wp.func
def _frame_attitude(frame: int, drone: wp.vec4) -> wp.vec4:
    if frame == DRONE_FRAME:
        return drone
    return wp.vec4(1.0, 0.0, 0.0, 0.0)


@wp.func
def _product(a: wp.vec4, b: wp.vec4) -> wp.vec4:
    return wp.vec4(
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@wp.func
def _rotation(q: wp.vec4) -> wp.mat33:
    ww, xx, yy, zz = q[0] * q[0], q[1] * q[1], q[2] * q[2], q[3] * q[3]
    wx, wy, wz = q[0] * q[1], q[0] * q[2], q[0] * q[3]
    xy, xz, yz = q[1] * q[2], q[1] * q[3], q[2] * q[3]
    return wp.mat33(
        ww + xx - yy - zz,
        2.0 * (xy - wz),
        2.0 * (xz + wy),
        2.0 * (xy + wz),
        ww - xx + yy - zz,
        2.0 * (yz - wx),
        2.0 * (xz - wy),
        2.0 * (yz + wx),
        ww - xx - yy + zz,
    )
