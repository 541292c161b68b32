"""Shading: the colour of a surface from light, shadow, texture and fog; writing of pixels."""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import ROUND
from drone_rl.sim.rendering.raytrace.projection_kernel import up_in_camera
from drone_rl.sim.rendering.raytrace.spans_kernel import (
    copy,
    copy_colors,
    fill_bytes,
    fill_floats,
    fill_ints,
    fill_vectors,
    mix_gray,
    multiply,
    shade_plain,
    shade_sky,
    shade_textured,
)
from drone_rl.sim.rendering.view import WEIGHTS

_RED, _GREEN, _BLUE = (wp.constant(weight) for weight in WEIGHTS)


@wp.func
def sky_pixel(materials: structs.Materials, world: int) -> structs.PixelValue:
    """Return what a pixel shows that hits nothing."""
    shown = structs.PixelValue()
    shown.number = -1
    shown.color = _bytes(materials.sky[world % materials.sky.shape[0]])
    shown.gray = _gray(shown.color)
    return shown


@wp.func
def geom_pixel(
    materials: structs.Materials, world: int, number: int, normal: wp.vec3
) -> structs.PixelValue:
    """Return what a pixel shows of a geom. Normal: world frame."""
    shown = structs.PixelValue()
    shown.number = number
    shown.normal = normal
    shown.color = _bytes(_shade(materials, world, number, normal))
    shown.gray = _gray(shown.color)
    return shown


@wp.func
def write_pixel(
    images: structs.Images,
    what: int,
    row: int,
    pixel: int,
    shown: structs.PixelValue,
    distance: float,
    cosine: float,
) -> None:
    """Write the requested modalities `what` of a pixel; `cosine` turns distance into depth."""
    if (what & structs.RGB) != 0:
        images.rgb[row, pixel] = shown.color
    if (what & structs.GRAY) != 0:
        images.gray[row, pixel] = shown.gray
    if (what & structs.DEPTH) != 0:
        images.depth[row, pixel] = distance * cosine
    if (what & structs.DISTANCE) != 0:
        images.distance[row, pixel] = distance
    if (what & structs.SEGMENTATION) != 0:
        images.segmentation[row, pixel] = shown.number
    if (what & structs.NORMALS) != 0:
        images.normals[row, pixel] = shown.normal


@wp.func
def write_span(
    images: structs.Images,
    what: int,
    row: int,
    first: int,
    last: int,
    shown: structs.PixelValue,
    distances: wp.array[float],
    cosines: wp.array[float],
) -> None:
    """`write_pixel` for a span of pixels with one value; distances and cosines of all pixels."""
    if (what & structs.RGB) != 0:
        fill_bytes(images.rgb[row], first, last, shown.color)
    if (what & structs.GRAY) != 0:
        fill_floats(images.gray[row], first, last, shown.gray)
    if (what & structs.DEPTH) != 0:
        multiply(images.depth[row], first, last, distances, cosines)
    if (what & structs.DISTANCE) != 0:
        copy(images.distance[row], first, last, distances)
    if (what & structs.SEGMENTATION) != 0:
        fill_ints(images.segmentation[row], first, last, shown.number)
    if (what & structs.NORMALS) != 0:
        fill_vectors(images.normals[row], first, last, shown.normal)


@wp.func
def write_colors(
    images: structs.Images, what: int, row: int, first: int, last: int, colors: wp.array[wp.vec3ub]
) -> None:
    """Write colours that differ from pixel to pixel; see `write_span`."""
    if (what & structs.RGB) != 0:
        copy_colors(images.rgb[row], first, last, colors)
    if (what & structs.GRAY) != 0:
        mix_gray(images.gray[row], first, last, colors, _RED, _GREEN, _BLUE)


@wp.func
def _shade(materials: structs.Materials, world: int, geom: int, normal: wp.vec3) -> wp.vec3:
    """Lambert's law under distant lights, 0 to 255. Normal: world frame."""
    own = materials.colors[world % materials.colors.shape[0], geom]
    row = world % materials.ambient.shape[0]
    color = wp.vec3()
    for light in range(materials.ambient.shape[1]):
        color += wp.cw_mul(own, materials.ambient[row, light])
    for light in range(materials.ambient.shape[1]):
        facing = wp.max(0.0, wp.dot(normal, -materials.direction[row, light]))
        color += wp.cw_mul(own, materials.diffuse[row, light] * facing)
    return 255.0 * wp.vec3(
        wp.clamp(color[0], 0.0, 1.0), wp.clamp(color[1], 0.0, 1.0), wp.clamp(color[2], 0.0, 1.0)
    )


@wp.func
def _bytes(color: wp.vec3) -> wp.vec3ub:
    return wp.vec3ub(wp.uint8(color[0]), wp.uint8(color[1]), wp.uint8(color[2]))


@wp.func
def _gray(color: wp.vec3ub) -> float:
    """Gray by `WEIGHTS`; each sum is rounded as by torch on x86."""
    red, green, blue = float(color[0]), float(color[1]), float(color[2])
    two = float(wp.float64(red * _RED) + wp.float64(green) * wp.float64(_GREEN))
    return float(wp.float64(two) + wp.float64(blue * _BLUE))


@wp.func
def color_sky(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    camera: structs.Camera,
    poses: structs.Poses,
    materials: structs.Materials,
    effects: structs.Effects,
    world: int,
) -> None:
    """Colour a span of the sky: the horizon blended with the zenith."""
    horizon = materials.sky[world % materials.sky.shape[0]]
    zenith = effects.zenith[world % effects.zenith.shape[0]]
    shade_sky(colors, first, last, rays, up_in_camera(camera, poses, world), horizon, zenith)


@wp.func
def color_geom(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    dark: wp.array[int],
    view: structs.View,
    camera: structs.Camera,
    materials: structs.Materials,
    effects: structs.Effects,
    world: int,
    geom_view: structs.GeomView,
    face: int,
    normal: wp.vec3,
) -> None:
    """Colour a span of a flat face, or one pixel of a round one: light, shadow, texture, fog.

    The normal is in the geom's frame; other arguments are those of `spans_kernel`.
    """
    own = 255.0 * materials.colors[world % materials.colors.shape[0], geom_view.number]
    lit, shaded = light_surface(materials, world, geom_view.axes @ normal)
    lit, shaded = wp.cw_mul(own, lit), wp.cw_mul(own, shaded)
    fog = effects.fog[world % effects.fog.shape[0]]
    horizon = materials.sky[world % materials.sky.shape[0]]
    row = world % effects.texture.shape[0]
    texture = effects.texture[row, geom_view.number]
    if texture < 0:
        shade_plain(colors, first, last, nearest, dark, lit, shaded, fog, horizon)
    else:
        tiles = effects.tiles[row, geom_view.number]
        start, side = effects.starts[texture], effects.sides[texture]
        cover = map_texture(start, side, tiles, geom_view, face, normal)
        pixel = 2.0 * camera.half_height / float(view.height) * tiles * float(side)
        cover.area = pixel * pixel
        texels = effects.texels
        shade_textured(
            colors, first, last, rays, nearest, dark, texels, cover, lit, shaded, fog, horizon
        )


@wp.func
def light_surface(
    materials: structs.Materials, world: int, normal: wp.vec3
) -> tuple[wp.vec3, wp.vec3]:
    """Return the light on a surface in the sun, and in shadow. Normal: world frame."""
    row = world % materials.ambient.shape[0]
    dark = wp.vec3()
    for light in range(materials.ambient.shape[1]):
        dark += materials.ambient[row, light]
        if light > 0:
            facing = wp.max(0.0, wp.dot(normal, -materials.direction[row, light]))
            dark += materials.diffuse[row, light] * facing
    facing = wp.max(0.0, wp.dot(normal, -materials.direction[row, 0]))
    return dark + materials.diffuse[row, 0] * facing, dark


@wp.func
def map_texture(
    start: int, side: int, tiles: float, geom_view: structs.GeomView, face: int, normal: wp.vec3
) -> structs.TextureMap:
    """Project a texture onto a face. Normal: geom's frame.

    A flat face shows two coordinates of the geom's frame; a round one shows those of the side of a
    box with the most similar normal.
    """
    axis = face // 2
    if face == ROUND:
        axis = int(wp.argmax(wp.vec3(wp.abs(normal[0]), wp.abs(normal[1]), wp.abs(normal[2]))))
    right, low = 0, 2
    if axis == 0:
        right = 1
    if axis == 2:
        low = 1
    cover = structs.TextureMap()
    cover.start = start
    cover.side = side
    cover.across = tiles * geom_view.into[right]
    cover.down = -tiles * geom_view.into[low]
    cover.corner = tiles * wp.vec2(geom_view.eye[right], -geom_view.eye[low])
    cover.facing = -(wp.transpose(geom_view.into) @ normal)
    return cover
