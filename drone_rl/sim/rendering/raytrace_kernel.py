# pyright: reportIndexIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles this file; Python's types say nothing about it.)
"""The ray tracer itself: one geom after the other, each only where it can be seen.

It draws whole worlds, one at a time, into pictures of sky alone. It takes the geoms in order and
casts rays at each in the rectangle of pixels around its projection alone, in the geom's
own frame; what is nearer than all before is painted over it. All geoms are convex and closed, or
planes seen from above, so a ray enters each at most once, and there is no other hit to look for.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace_solids import PLANE, enter, meet_plane

RGB, DEPTH, SEGMENTATION = wp.constant(0), wp.constant(1), wp.constant(2)
DRONE_FRAME = wp.constant(1)
"""The only frame that turns; 0 is the world's and the props' follow."""

_SAME = wp.constant(1e-6)
"""Relative distance within which the later of two geoms is in front, as in OpenGL."""
_FAR_AWAY = wp.constant(1e10)
_IN_FRONT = wp.constant(1e-3)
"""Metres before the camera from which corners are projected."""


@wp.struct
class Camera:
    """One camera and its picture."""

    frame: int
    position: wp.vec3
    """In its frame, metres."""
    attitude: wp.vec4
    """In its frame, (w, x, y, z); it looks along its own -z, with y up."""
    half_width: float
    """Of the picture at a distance of 1."""
    half_height: float
    width: int
    height: int
    far: float
    """Metres along the axis beyond which nothing is drawn."""


@wp.struct
class Geoms:
    """What is drawn, in the model's order."""

    kind: wp.array[int]
    number: wp.array[int]
    """In the model."""
    frame: wp.array[int]
    position: wp.array[wp.vec3]
    attitude: wp.array[wp.vec4]
    size: wp.array[wp.vec3]
    reach: wp.array[wp.vec3]
    """Half extents of the box around each, in its own frame."""


@wp.struct
class Sight:
    """One geom as one world's camera sees it."""

    kind: int
    number: int
    size: wp.vec3
    reach: wp.vec3
    eye: wp.vec3
    """The camera's place in the geom's frame."""
    into: wp.mat33
    """Turns directions from the camera's frame to the geom's."""
    axes: wp.mat33
    """The same from the geom's to the world's."""


@wp.struct
class Looks:
    """Colours and light; first dimension: one for all worlds or one for each."""

    colors: wp.array2d[wp.vec3]
    ambient: wp.array2d[wp.vec3]
    diffuse: wp.array2d[wp.vec3]
    direction: wp.array2d[wp.vec3]


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


@wp.func
def _frame_attitude(frame: int, drone: wp.vec4) -> wp.vec4:
    if frame == DRONE_FRAME:
        return drone
    return wp.vec4(1.0, 0.0, 0.0, 0.0)


@wp.func
def _shade(looks: Looks, world: int, geom: int, normal: wp.vec3) -> wp.vec3:
    """Lambert's law under distant lights, from 0 to 255. Normal: world frame."""
    own = looks.colors[world % looks.colors.shape[0], geom]
    row = world % looks.ambient.shape[0]
    color = wp.vec3()
    for light in range(looks.ambient.shape[1]):
        color += wp.cw_mul(own, looks.ambient[row, light])
    for light in range(looks.ambient.shape[1]):
        facing = wp.max(0.0, wp.dot(normal, -looks.direction[row, light]))
        color += wp.cw_mul(own, looks.diffuse[row, light] * facing)
    return 255.0 * wp.vec3(
        wp.clamp(color[0], 0.0, 1.0), wp.clamp(color[1], 0.0, 1.0), wp.clamp(color[2], 0.0, 1.0)
    )


@wp.func
def _first(place: float, half: float, count: int) -> int:
    """The first pixel that can show a place, given along an axis at a distance of 1."""
    pixel = (place / half + 1.0) * 0.5 * float(count) - 1.5
    return int(wp.clamp(wp.floor(pixel), 0.0, float(count)))


@wp.func
def _around(camera: Camera, sight: Sight) -> wp.vec4i:
    """Columns and rows, from and to, outside which no ray meets a geom."""
    lowest = wp.vec2(_FAR_AWAY, _FAR_AWAY)
    highest = wp.vec2(-_FAR_AWAY, -_FAR_AWAY)
    behind = 0
    for corner in range(8):
        sides = wp.vec3(
            float(corner & 1) * 2.0 - 1.0,
            float((corner >> 1) & 1) * 2.0 - 1.0,
            float((corner >> 2) & 1) * 2.0 - 1.0,
        )
        at = wp.transpose(sight.into) @ (wp.cw_mul(sides, sight.reach) - sight.eye)
        if -at[2] < _IN_FRONT:
            behind += 1
        else:
            seen = wp.vec2(at[0] / -at[2], -at[1] / -at[2])
            lowest = wp.min(lowest, seen)
            highest = wp.max(highest, seen)
    if behind == 8:
        return wp.vec4i(0, 0, 0, 0)
    if behind > 0:
        return wp.vec4i(0, camera.width, 0, camera.height)
    return wp.vec4i(
        _first(lowest[0], camera.half_width, camera.width),
        wp.min(_first(highest[0], camera.half_width, camera.width) + 3, camera.width),
        _first(lowest[1], camera.half_height, camera.height),
        wp.min(_first(highest[1], camera.half_height, camera.height) + 3, camera.height),
    )


@wp.func
def _is_nearest(along: float, so_far: float, ray: wp.vec3, far: float) -> bool:
    return along >= 0.0 and along - so_far <= _SAME * wp.max(so_far, 1.0) and along * -ray[2] <= far


@wp.func
def _paint(rgb: wp.array2d[wp.uint8], world: int, pixel: int, color: wp.vec3) -> None:
    rgb[world, 3 * pixel] = wp.uint8(color[0])
    rgb[world, 3 * pixel + 1] = wp.uint8(color[1])
    rgb[world, 3 * pixel + 2] = wp.uint8(color[2])


@wp.func
def _put(
    what: int,
    world: int,
    pixel: int,
    along: float,
    ray: wp.vec3,
    sight: Sight,
    color: wp.vec3,
    nearest: wp.array[float],
    rgb: wp.array2d[wp.uint8],
    depths: wp.array2d[float],
    numbers: wp.array2d[int],
) -> None:
    nearest[pixel] = along
    if what == RGB:
        _paint(rgb, world, pixel, color)
    elif what == DEPTH:
        depths[world, pixel] = along * -ray[2]
    else:
        numbers[world, pixel] = sight.number


@wp.func
def _draw_plane(
    what: int,
    world: int,
    camera: Camera,
    rays: wp.array[wp.vec3],
    sight: Sight,
    looks: Looks,
    nearest: wp.array[float],
    rgb: wp.array2d[wp.uint8],
    depths: wp.array2d[float],
    numbers: wp.array2d[int],
) -> None:
    """Of one colour, in the rows that end below its horizon."""
    color = _shade(looks, world, sight.number, sight.axes @ wp.vec3(0.0, 0.0, 1.0))
    width = camera.width
    for start in range(0, camera.height * width, width):
        left = wp.dot(sight.into[2], rays[start])
        right = wp.dot(sight.into[2], rays[start + width - 1])
        if left < 0.0 or right < 0.0:
            for pixel in range(start, start + width):
                ray = rays[pixel]
                along = meet_plane(sight.size, sight.eye, sight.into @ ray)
                if _is_nearest(along, nearest[pixel], ray, camera.far):
                    _put(
                        what, world, pixel, along, ray, sight, color, nearest, rgb, depths, numbers
                    )


@wp.func
def _draw_solid(
    what: int,
    world: int,
    camera: Camera,
    rays: wp.array[wp.vec3],
    sight: Sight,
    looks: Looks,
    nearest: wp.array[float],
    rgb: wp.array2d[wp.uint8],
    depths: wp.array2d[float],
    numbers: wp.array2d[int],
) -> None:
    """In the rectangle of pixels around it."""
    part = _around(camera, sight)
    for row in range(part[2], part[3]):
        for pixel in range(row * camera.width + part[0], row * camera.width + part[1]):
            ray = rays[pixel]
            along, normal = enter(sight.kind, sight.size, sight.eye, sight.into @ ray)
            if _is_nearest(along, nearest[pixel], ray, camera.far):
                color = wp.vec3()
                if what == RGB:
                    color = _shade(looks, world, sight.number, sight.axes @ normal)
                _put(what, world, pixel, along, ray, sight, color, nearest, rgb, depths, numbers)


@wp.func
def _look_at(
    geoms: Geoms, geom: int, frame: wp.vec3, turned: wp.vec4, eye: wp.vec3, looking: wp.mat33
) -> Sight:
    """A geom whose frame is there and turned so, seen by a camera."""
    centre = frame + _rotation(turned) @ geoms.position[geom]
    sight = Sight()
    sight.kind = geoms.kind[geom]
    sight.number = geoms.number[geom]
    sight.size = geoms.size[geom]
    sight.reach = geoms.reach[geom]
    sight.axes = _rotation(_product(turned, geoms.attitude[geom]))
    sight.eye = wp.transpose(sight.axes) @ (eye - centre)
    sight.into = wp.transpose(sight.axes) @ looking
    return sight


@wp.kernel(enable_backward=False)
def draw(
    first: int,
    last: int,
    what: int,
    camera: Camera,
    rays: wp.array[wp.vec3],
    geoms: Geoms,
    places: wp.array2d[wp.vec3],
    attitudes: wp.array[wp.vec4],
    looks: Looks,
    nearest: wp.array[float],
    rgb: wp.array2d[wp.uint8],
    depths: wp.array2d[float],
    numbers: wp.array2d[int],
) -> None:
    """Draws worlds one after the other, by a single worker: launch it with a dimension of 1.

    Args:
        first: The first world.
        last: The one after the last.
        what: `RGB`, `DEPTH` or `SEGMENTATION`.
        camera: Whose picture.
        rays: Directions of length 1 in the camera's frame, of all pixels, row by row.
        geoms: What is drawn.
        places: Of the frames. Shape: (num_worlds, num_frames).
        attitudes: Of the drones, quaternions (w, x, y, z) of length 1. Shape: (num_worlds,).
        looks: Colours and light.
        nearest: To work with, one a pixel: how far along its ray the nearest surface is.
        rgb: Pictures of the sky, three bytes a pixel, to draw into. First dimension: worlds.
        depths: The same for depths.
        numbers: The same for numbers of geoms.
    """
    for world in range(first, last):
        drone = attitudes[world]
        turned = _frame_attitude(camera.frame, drone)
        eye = places[world, camera.frame] + _rotation(turned) @ camera.position
        looking = _rotation(_product(turned, camera.attitude))
        for pixel in range(camera.height * camera.width):
            nearest[pixel] = _FAR_AWAY
        for geom in range(geoms.kind.shape[0]):
            frame = geoms.frame[geom]
            turned = _frame_attitude(frame, drone)
            sight = _look_at(geoms, geom, places[world, frame], turned, eye, looking)
            if sight.kind == PLANE:
                _draw_plane(what, world, camera, rays, sight, looks, nearest, rgb, depths, numbers)
            else:
                _draw_solid(what, world, camera, rays, sight, looks, nearest, rgb, depths, numbers)
