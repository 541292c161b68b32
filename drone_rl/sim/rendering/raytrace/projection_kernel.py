"""Projection: poses of cameras and geoms, and the pixels that can show a geom or its shadow."""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import FAR_AWAY
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    DRONE_FRAME,
    Geoms,
    GeomView,
    Job,
    PoseArrays,
    Scratch,
    ViewArrays,
)

NEAR = wp.constant(1e-3)
"""Metres in front of the camera from which corners are projected."""


@wp.func
def start_job(
    view: ViewArrays,
    poses: PoseArrays,
    scratch: Scratch,
    row: int,
    camera: int,
    env: int,
    buffer: int,
) -> Job:
    """Return the job of rendering image `row` with row `buffer` of `Scratch`."""
    job = Job()
    job.row = row
    job.env = env
    job.view = view
    job.camera = view.cameras[camera]
    turned = frame_attitude(job.camera.frame, poses.attitudes[env])
    origin = poses.positions[env, job.camera.frame]
    job.eye = origin + rotation(turned) @ job.camera.position
    job.camera_to_world = rotation(product(turned, job.camera.attitude))
    job.rays = view.rays[camera]
    job.cosines = view.cosines[camera]
    job.nearest = scratch.nearest[buffer]
    job.owner = scratch.owner[buffer]
    job.dark = scratch.dark[buffer]
    job.colors = scratch.colors[buffer]
    job.geom_views = scratch.geom_views[buffer]
    return job


@wp.func
def view_geom(job: Job, geoms: Geoms, geom: int, poses: PoseArrays) -> GeomView:
    """Return a geom relative to the camera."""
    frame = geoms.frame[geom]
    turned = frame_attitude(frame, poses.attitudes[job.env])
    centre = poses.positions[job.env, frame] + rotation(turned) @ geoms.position[geom]
    geom_view = GeomView()
    geom_view.kind = geoms.kind[geom]
    geom_view.number = geoms.number[geom]
    geom_view.size = geoms.size[geom]
    geom_view.reach = geoms.reach[geom]
    if poses.scales:
        geom_view.size *= poses.scales[job.env, frame]
        geom_view.reach *= poses.scales[job.env, frame]
    geom_view.axes = rotation(product(turned, geoms.attitude[geom]))
    geom_view.eye = wp.transpose(geom_view.axes) @ (job.eye - centre)
    geom_view.into = wp.transpose(geom_view.axes) @ job.camera_to_world
    return geom_view


@wp.func
def bounding_rectangle(job: Job, geom_view: GeomView, shadow: wp.vec3) -> wp.vec4i:
    """Return the pixels that can show a geom or its shadow: first and last+1 column, then rows.

    `shadow` leads from the geom to the end of its shadow, world frame; zero for no shadow.
    """
    to_camera = wp.transpose(geom_view.into)
    centre = -(to_camera @ geom_view.eye)
    swept = to_camera @ (wp.transpose(geom_view.axes) @ shadow)
    sides = to_camera @ wp.diag(geom_view.reach)
    bits = int(3)
    if wp.length_sq(shadow) > 0.0:
        bits = 4
    lowest = wp.vec2(FAR_AWAY, FAR_AWAY)
    highest = wp.vec2(-FAR_AWAY, -FAR_AWAY)
    behind = int(0)
    for corner in range(1 << bits):
        at = _corner(corner, centre, sides, swept)
        if -at[2] < NEAR:
            behind += 1 << corner
        else:
            seen = wp.vec2(at[0] / -at[2], -at[1] / -at[2])
            lowest = wp.min(lowest, seen)
            highest = wp.max(highest, seen)
    if behind == (1 << (1 << bits)) - 1:
        return wp.vec4i(0, 0, 0, 0)
    if behind > 0:
        for edge in range(bits << bits):  # clip edges that lead behind the camera
            one, other = edge // bits, (edge // bits) ^ (1 << (edge % bits))
            if ((behind >> one) & 1) == 0 and ((behind >> other) & 1) == 1:
                at = _corner(one, centre, sides, swept)
                hidden = _corner(other, centre, sides, swept)
                at += (at[2] + NEAR) / (at[2] - hidden[2]) * (hidden - at)
                seen = wp.vec2(at[0], -at[1]) / NEAR
                lowest = wp.min(lowest, seen)
                highest = wp.max(highest, seen)
    wide, high = job.camera.half_width, job.camera.half_height
    return wp.vec4i(
        _first_pixel(lowest[0], wide, job.view.width),
        wp.min(_first_pixel(highest[0], wide, job.view.width) + 3, job.view.width),
        _first_pixel(lowest[1], high, job.view.height),
        wp.min(_first_pixel(highest[1], high, job.view.height) + 3, job.view.height),
    )


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
def _first_pixel(place: float, half: float, count: int) -> int:
    """First pixel along an axis that can show a coordinate of the image plane."""
    pixel = (place / half + 1.0) * 0.5 * float(count) - 1.5
    return int(wp.clamp(wp.floor(pixel), 0.0, float(count)))


@wp.func
def frame_attitude(frame: int, drone: wp.vec4) -> wp.vec4:
    """Return the attitude of a frame, given the drone's."""
    if frame == DRONE_FRAME:
        return drone
    return wp.vec4(1.0, 0.0, 0.0, 0.0)


@wp.func
def product(a: wp.vec4, b: wp.vec4) -> wp.vec4:
    """Multiply quaternions (w, x, y, z): b in the frame of a."""
    return wp.vec4(
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@wp.func
def rotation(q: wp.vec4) -> wp.mat33:
    """Return the rotation matrix of a quaternion (w, x, y, z)."""
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
