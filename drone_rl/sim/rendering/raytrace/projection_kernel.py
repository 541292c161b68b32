"""Projection: poses of cameras and geoms, and the pixels that can show a geom."""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import FAR_AWAY
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    DRONE_FRAME,
    Camera,
    CameraPose,
    Geoms,
    GeomView,
    Poses,
    View,
)

IN_FRONT = wp.constant(1e-3)
"""Metres in front of the camera from which corners are projected."""


@wp.func
def camera_pose(camera: Camera, poses: Poses, world: int) -> CameraPose:
    """Return the world pose of a camera."""
    turned = _frame_attitude(camera.frame, poses.attitudes[world])
    found = CameraPose()
    found.eye = poses.positions[world, camera.frame] + _rotation(turned) @ camera.position
    found.looking = _rotation(_product(turned, camera.attitude))
    return found


@wp.func
def view_geom(geoms: Geoms, geom: int, poses: Poses, world: int, there: CameraPose) -> GeomView:
    """Return a geom of an environment relative to a camera."""
    frame = geoms.frame[geom]
    turned = _frame_attitude(frame, poses.attitudes[world])
    centre = poses.positions[world, frame] + _rotation(turned) @ geoms.position[geom]
    geom_view = GeomView()
    geom_view.kind = geoms.kind[geom]
    geom_view.number = geoms.number[geom]
    geom_view.size = geoms.size[geom]
    geom_view.reach = geoms.reach[geom]
    if poses.scales:
        geom_view.size *= poses.scales[world, frame]
        geom_view.reach *= poses.scales[world, frame]
    geom_view.axes = _rotation(_product(turned, geoms.attitude[geom]))
    geom_view.eye = wp.transpose(geom_view.axes) @ (there.eye - centre)
    geom_view.into = wp.transpose(geom_view.axes) @ there.looking
    return geom_view


@wp.func
def up_in_camera(camera: Camera, poses: Poses, world: int) -> wp.vec3:
    """Return the world's up axis in a camera's frame."""
    turned = _frame_attitude(camera.frame, poses.attitudes[world])
    return wp.transpose(_rotation(_product(turned, camera.attitude))) @ wp.vec3(0.0, 0.0, 1.0)


@wp.func
def bounding_rectangle(view: View, camera: Camera, geom_view: GeomView) -> wp.vec4i:
    """Return first and last+1 column, first and last+1 row outside which no ray meets a geom."""
    lowest = wp.vec2(FAR_AWAY, FAR_AWAY)
    highest = wp.vec2(-FAR_AWAY, -FAR_AWAY)
    behind = int(0)
    for corner in range(8):
        at = _corner(geom_view, corner)
        if -at[2] < IN_FRONT:
            behind += 1 << corner
        else:
            seen = wp.vec2(at[0] / -at[2], -at[1] / -at[2])
            lowest = wp.min(lowest, seen)
            highest = wp.max(highest, seen)
    if behind == 255:
        return wp.vec4i(0, 0, 0, 0)
    if behind > 0:
        for edge in range(24):  # clip edges that lead behind the camera
            one, other = edge // 3, (edge // 3) ^ (1 << (edge % 3))
            if ((behind >> one) & 1) == 0 and ((behind >> other) & 1) == 1:
                at, back = _corner(geom_view, one), _corner(geom_view, other)
                at += (at[2] + IN_FRONT) / (at[2] - back[2]) * (back - at)
                seen = wp.vec2(at[0], -at[1]) / IN_FRONT
                lowest = wp.min(lowest, seen)
                highest = wp.max(highest, seen)
    return pixel_rectangle(view, camera, lowest, highest)


@wp.func
def _corner(geom_view: GeomView, corner: int) -> wp.vec3:
    """A corner of the bounding box, in the camera's frame."""
    sides = wp.vec3(
        float(corner & 1) * 2.0 - 1.0,
        float((corner >> 1) & 1) * 2.0 - 1.0,
        float((corner >> 2) & 1) * 2.0 - 1.0,
    )
    return wp.transpose(geom_view.into) @ (wp.cw_mul(sides, geom_view.reach) - geom_view.eye)


@wp.func
def pixel_rectangle(view: View, camera: Camera, lowest: wp.vec2, highest: wp.vec2) -> wp.vec4i:
    """Return the pixels that can show anything between two points of the image plane.

    Points are right and down, on the plane at distance 1. Returns first and last+1 column, and row.
    """
    return wp.vec4i(
        _first_pixel(lowest[0], camera.half_width, view.width),
        wp.min(_first_pixel(highest[0], camera.half_width, view.width) + 3, view.width),
        _first_pixel(lowest[1], camera.half_height, view.height),
        wp.min(_first_pixel(highest[1], camera.half_height, view.height) + 3, view.height),
    )


@wp.func
def _first_pixel(place: float, half: float, count: int) -> int:
    """First pixel along an axis that can show a coordinate of the image plane."""
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
