# pyright: reportIndexIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles this file; Python's types say nothing about it.)
"""What a pixel shows of the surface that its ray has met."""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import ROUND
from drone_rl.sim.rendering.raytrace.projection_kernel import upward
from drone_rl.sim.rendering.raytrace.spans_kernel import (
    Cover,
    copy,
    copy_colors,
    fill_bytes,
    fill_floats,
    fill_ints,
    fill_vectors,
    mix_gray,
    multiply,
    shade_covered,
    shade_even,
    shade_sky,
)
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    DEPTH,
    DISTANCE,
    GRAY,
    NORMALS,
    RGB,
    SEGMENTATION,
    Camera,
    Looks,
    Pictures,
    Poses,
    Scenery,
    Sight,
    View,
)
from drone_rl.sim.rendering.view import WEIGHTS

_RED, _GREEN, _BLUE = (wp.constant(weight) for weight in WEIGHTS)


@wp.struct
class Shown:
    """What is seen in a pixel, but for how far away it is."""

    number: int
    """Of the geom in the model; -1 for none."""
    normal: wp.vec3
    """World frame; zero for none."""
    color: wp.vec3ub
    gray: float
    """From 0 to 1."""


@wp.func
def show_sky(looks: Looks, world: int) -> Shown:
    """What is seen where nothing was met."""
    shown = Shown()
    shown.number = -1
    shown.color = _bytes(looks.sky[world % looks.sky.shape[0]])
    shown.gray = _gray(shown.color)
    return shown


@wp.func
def show_geom(looks: Looks, world: int, number: int, normal: wp.vec3) -> Shown:
    """What is seen where a geom was met. Normal: world frame."""
    shown = Shown()
    shown.number = number
    shown.normal = normal
    shown.color = _bytes(_shade(looks, world, number, normal))
    shown.gray = _gray(shown.color)
    return shown


@wp.func
def put_pixel(
    pictures: Pictures,
    what: int,
    row: int,
    pixel: int,
    shown: Shown,
    distance: float,
    cosine: float,
) -> None:
    """Writes a pixel.

    Args:
        pictures: Into which.
        what: What of it is asked for.
        row: Which picture.
        pixel: Which.
        shown: What it shows.
        distance: How far along its ray that is; 0 for the sky.
        cosine: Of the angle between the ray and the camera's axis.
    """
    if (what & RGB) != 0:
        pictures.rgb[row, pixel] = shown.color
    if (what & GRAY) != 0:
        pictures.gray[row, pixel] = shown.gray
    if (what & DEPTH) != 0:
        pictures.depth[row, pixel] = distance * cosine
    if (what & DISTANCE) != 0:
        pictures.distance[row, pixel] = distance
    if (what & SEGMENTATION) != 0:
        pictures.segmentation[row, pixel] = shown.number
    if (what & NORMALS) != 0:
        pictures.normals[row, pixel] = shown.normal


@wp.func
def put_run(
    pictures: Pictures,
    what: int,
    row: int,
    first: int,
    last: int,
    shown: Shown,
    distances: wp.array[float],
    cosines: wp.array[float],
) -> None:
    """The same of pixels in a row that show the same.

    Args:
        pictures: Into which.
        what: What of it is asked for.
        row: Which picture.
        first: The first pixel.
        last: The one after the last.
        shown: What they show.
        distances: How far along its ray that is, of each pixel of the picture; 0 for the sky.
        cosines: Of each pixel of the picture.
    """
    if (what & RGB) != 0:
        fill_bytes(pictures.rgb[row], first, last, shown.color)
    if (what & GRAY) != 0:
        fill_floats(pictures.gray[row], first, last, shown.gray)
    if (what & DEPTH) != 0:
        multiply(pictures.depth[row], first, last, distances, cosines)
    if (what & DISTANCE) != 0:
        copy(pictures.distance[row], first, last, distances)
    if (what & SEGMENTATION) != 0:
        fill_ints(pictures.segmentation[row], first, last, shown.number)
    if (what & NORMALS) != 0:
        fill_vectors(pictures.normals[row], first, last, shown.normal)


@wp.func
def put_colors(
    pictures: Pictures, what: int, row: int, first: int, last: int, colors: wp.array[wp.vec3ub]
) -> None:
    """Writes colours, each pixel its own; see `put_run`."""
    if (what & RGB) != 0:
        copy_colors(pictures.rgb[row], first, last, colors)
    if (what & GRAY) != 0:
        mix_gray(pictures.gray[row], first, last, colors, _RED, _GREEN, _BLUE)


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
def _bytes(color: wp.vec3) -> wp.vec3ub:
    return wp.vec3ub(wp.uint8(color[0]), wp.uint8(color[1]), wp.uint8(color[2]))


@wp.func
def _gray(color: wp.vec3ub) -> float:
    """The product of a colour and `WEIGHTS`, each sum rounded as by torch on x86."""
    red, green, blue = float(color[0]), float(color[1]), float(color[2])
    two = float(wp.float64(red * _RED) + wp.float64(green) * wp.float64(_GREEN))
    return float(wp.float64(two) + wp.float64(blue * _BLUE))


@wp.func
def color_sky(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    camera: Camera,
    poses: Poses,
    looks: Looks,
    scenery: Scenery,
    world: int,
) -> None:
    """Colours pixels in a row that show the sky.

    Args:
        colors: Are written.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        camera: Who looks.
        poses: Where everything is.
        looks: The sky's colour at the horizon.
        scenery: That overhead.
        world: Whose.
    """
    horizon = looks.sky[world % looks.sky.shape[0]]
    zenith = scenery.zenith[world % scenery.zenith.shape[0]]
    shade_sky(colors, first, last, rays, upward(camera, poses, world), horizon, zenith)


@wp.func
def color_geom(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    dark: wp.array[int],
    view: View,
    camera: Camera,
    looks: Looks,
    scenery: Scenery,
    world: int,
    sight: Sight,
    face: int,
    normal: wp.vec3,
) -> None:
    """Colours pixels in a row that show a flat face of a geom, or one that shows a round one.

    Args:
        colors: Are written.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        nearest: How far along its ray the face is.
        dark: Whether it is in shadow there.
        view: Whose pixels.
        camera: Who looks.
        looks: Colours and light.
        scenery: Textures and fog.
        world: Whose.
        sight: The geom.
        face: Which of its faces.
        normal: Of the face, in the geom's frame.
    """
    own = 255.0 * looks.colors[world % looks.colors.shape[0], sight.number]
    lit, shaded = light_on(looks, world, sight.axes @ normal)
    lit, shaded = wp.cw_mul(own, lit), wp.cw_mul(own, shaded)
    fog = scenery.fog[world % scenery.fog.shape[0]]
    horizon = looks.sky[world % looks.sky.shape[0]]
    row = world % scenery.texture.shape[0]
    texture = scenery.texture[row, sight.number]
    if texture < 0:
        shade_even(colors, first, last, nearest, dark, lit, shaded, fog, horizon)
    else:
        tiles = scenery.tiles[row, sight.number]
        start, side = scenery.starts[texture], scenery.sides[texture]
        cover = lay(start, side, tiles, sight, face, normal)
        pixel = 2.0 * camera.half_height / float(view.height) * tiles * float(side)
        cover.area = pixel * pixel
        texels = scenery.texels
        shade_covered(
            colors, first, last, rays, nearest, dark, texels, cover, lit, shaded, fog, horizon
        )


@wp.func
def light_on(looks: Looks, world: int, normal: wp.vec3) -> tuple[wp.vec3, wp.vec3]:
    """Light on a surface in the sun, and in its shadow. Normal: world frame."""
    row = world % looks.ambient.shape[0]
    dark = wp.vec3()
    for light in range(looks.ambient.shape[1]):
        dark += looks.ambient[row, light]
        if light > 0:
            facing = wp.max(0.0, wp.dot(normal, -looks.direction[row, light]))
            dark += looks.diffuse[row, light] * facing
    facing = wp.max(0.0, wp.dot(normal, -looks.direction[row, 0]))
    return dark + looks.diffuse[row, 0] * facing, dark


@wp.func
def lay(start: int, side: int, tiles: float, sight: Sight, face: int, normal: wp.vec3) -> Cover:
    """Lays a texture on a face.

    A flat face shows two coordinates of the geom's own frame; what is round shows those of the side
    of a box that looks most the same way.

    Args:
        start: Where its texels begin.
        side: How many these are, each way.
        tiles: In a metre.
        sight: The geom.
        face: Which of its faces.
        normal: Of the face, in the geom's frame.
    """
    axis = face // 2
    if face == ROUND:
        axis = int(wp.argmax(wp.vec3(wp.abs(normal[0]), wp.abs(normal[1]), wp.abs(normal[2]))))
    right, low = 0, 2
    if axis == 0:
        right = 1
    if axis == 2:
        low = 1
    cover = Cover()
    cover.start = start
    cover.side = side
    cover.across = tiles * sight.into[right]
    cover.down = -tiles * sight.into[low]
    cover.corner = tiles * wp.vec2(sight.eye[right], -sight.eye[low])
    cover.facing = -(wp.transpose(sight.into) @ normal)
    return cover
