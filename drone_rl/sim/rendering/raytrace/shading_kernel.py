"""Shading: the color of a surface from light, shadow, texture and fog; writing of pixels."""

import warp as wp

from drone_rl.sim.rendering.raytrace import spans_kernel as spans
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.intersection_kernel import ROUND, surface_normal
from drone_rl.sim.rendering.view import WEIGHTS

RED, GREEN, BLUE = (wp.constant(weight) for weight in WEIGHTS)
"""Of gray, for bytes."""


@wp.func
def shade_span(
    job: structs.Job,
    materials: structs.Materials,
    images: structs.Images,
    first: int,
    last: int,
    owner: int,
    distance: float,
) -> None:
    """Write a span of the sky or of one flat face, or one pixel of a round face.

    `owner` and `distance` are those of the first pixel.
    """
    shown = _find_surface(job, first, last, owner, distance)
    if shown.number == structs.NO_GEOM:
        shown.color = to_bytes(materials.sky[job.env % materials.sky.shape[0]])
    else:
        shown.color = to_bytes(_lambert(materials, job.env, shown.number, shown.normal))
    shown.gray = gray_of(shown.color)
    write_span(job, images, job.view.what, first, last, shown)


@wp.func
def shade_span_with_effects(
    job: structs.Job,
    materials: structs.Materials,
    effects: structs.Effects,
    images: structs.Images,
    first: int,
    last: int,
) -> None:
    """`shade_span` with fog, shadow, texture and a sky gradient."""
    shown = _find_surface(job, first, last, job.owner[first], job.nearest[first])
    if shown.number == structs.NO_GEOM:
        up = wp.transpose(job.camera_to_world) @ wp.vec3(0.0, 0.0, 1.0)
        horizon = materials.sky[job.env % materials.sky.shape[0]]
        zenith = effects.zenith[job.env % effects.zenith.shape[0]]
        spans.shade_sky(job, first, last, up, horizon, zenith)
    else:
        _color_geom(job, materials, effects, first, last, shown)
    what = job.view.what
    write_span(job, images, what & ~(structs.RGB | structs.GRAY), first, last, shown)
    if (what & structs.RGB) != 0:
        spans.copy(images.rgb[job.row], first, last, job.colors)
    if (what & structs.GRAY) != 0:
        spans.mix_gray(images.gray[job.row], first, last, job.colors, RED, GREEN, BLUE)


@wp.func
def _find_surface(
    job: structs.Job, first: int, last: int, owner: int, distance: float
) -> structs.PixelValue:
    """Return what a span shows, without its color; set its distance to 0 if that is the sky."""
    shown = structs.PixelValue()
    shown.number = structs.NO_GEOM
    if owner == structs.NO_GEOM:
        if (job.view.what & structs.DISTANCES) != 0:
            spans.fill(job.nearest, first, last, 0.0)
    else:
        seen = job.geom_views[owner // structs.FACES]
        into = seen.into @ job.rays[first]
        shown.number = seen.number
        shown.face = owner % structs.FACES
        shown.face_normal = surface_normal(
            seen.kind, seen.size, shown.face, seen.eye, into, distance
        )
        shown.normal = seen.axes @ shown.face_normal
    return shown


@wp.func
def write_span(
    job: structs.Job,
    images: structs.Images,
    what: int,
    first: int,
    last: int,
    shown: structs.PixelValue,
) -> None:
    """Write the modalities `what` of a span of pixels that show one surface."""
    if (what & structs.RGB) != 0:
        spans.fill(images.rgb[job.row], first, last, shown.color)
    if (what & structs.GRAY) != 0:
        spans.fill(images.gray[job.row], first, last, shown.gray)
    if (what & structs.DEPTH) != 0:
        spans.multiply(images.depth[job.row], first, last, job.nearest, job.cosines)
    if (what & structs.DISTANCE) != 0:
        spans.copy(images.distance[job.row], first, last, job.nearest)
    if (what & structs.SEGMENTATION) != 0:
        spans.fill(images.segmentation[job.row], first, last, shown.number)
    if (what & structs.NORMALS) != 0:
        spans.fill(images.normals[job.row], first, last, shown.normal)


@wp.func
def _lambert(materials: structs.Materials, env: int, geom: int, normal: wp.vec3) -> wp.vec3:
    """Lambert's law under distant lights, 0 to 255. Normal: world frame."""
    albedo = materials.colors[env % materials.colors.shape[0], geom]
    row = env % materials.ambient.shape[0]
    color = wp.vec3()
    for light in range(materials.ambient.shape[1]):
        color += wp.cw_mul(albedo, materials.ambient[row, light])
    for light in range(materials.ambient.shape[1]):
        facing = wp.max(0.0, wp.dot(normal, -materials.direction[row, light]))
        color += wp.cw_mul(albedo, materials.diffuse[row, light] * facing)
    return 255.0 * wp.vec3(
        wp.clamp(color[0], 0.0, 1.0), wp.clamp(color[1], 0.0, 1.0), wp.clamp(color[2], 0.0, 1.0)
    )


@wp.func
def to_bytes(color: wp.vec3) -> wp.vec3ub:
    """Round a color of 0 to 255 down to bytes."""
    return wp.vec3ub(wp.uint8(color[0]), wp.uint8(color[1]), wp.uint8(color[2]))


@wp.func
def gray_of(color: wp.vec3ub) -> float:
    """Return fma(green, G, red * R) + blue * B in float32, as torch does on x86 by `WEIGHTS`."""
    red, green, blue = float(color[0]), float(color[1]), float(color[2])
    two = float(wp.float64(red * RED) + wp.float64(green) * wp.float64(GREEN))
    return float(wp.float64(two) + wp.float64(blue * BLUE))


@wp.func
def _color_geom(
    job: structs.Job,
    materials: structs.Materials,
    effects: structs.Effects,
    first: int,
    last: int,
    shown: structs.PixelValue,
) -> None:
    env, geom = job.env, shown.number
    albedo = 255.0 * materials.colors[env % materials.colors.shape[0], geom]
    lit, shaded = light_surface(materials, env, shown.normal)
    light = structs.SurfaceLight()
    light.lit = wp.cw_mul(albedo, lit)
    light.shaded = wp.cw_mul(albedo, shaded)
    light.extinction = effects.extinction[env % effects.extinction.shape[0]]
    light.horizon = materials.sky[env % materials.sky.shape[0]]
    row = env % effects.texture.shape[0]
    texture = effects.texture[row, geom]
    if texture < 0:
        spans.shade_plain(job, first, last, light)
    else:
        tiles, side = effects.tiles[row, geom], effects.sides[texture]
        geom_view = job.geom_views[job.owner[first] // structs.FACES]
        texture_map = map_texture(tiles, geom_view, shown.face, shown.face_normal)
        texture_map.start = effects.starts[texture]
        texture_map.side = side
        pixel = 2.0 * job.camera.half_height / float(job.view.height) * tiles * float(side)
        texture_map.area = pixel * pixel
        spans.shade_textured(job, first, last, light, texture_map, effects.texels)


@wp.func
def light_surface(
    materials: structs.Materials, env: int, normal: wp.vec3
) -> tuple[wp.vec3, wp.vec3]:
    """Return the light on a surface with and without light 0, the sun. Normal: world frame."""
    row = env % materials.ambient.shape[0]
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
    tiles: float, geom_view: structs.GeomView, face: int, normal: wp.vec3
) -> structs.TextureMap:
    """Project a texture, `tiles` of it per metre, onto a face. Normal: geom's frame.

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
    texture_map = structs.TextureMap()
    texture_map.across = tiles * geom_view.into[right]
    texture_map.down = -tiles * geom_view.into[low]
    texture_map.corner = tiles * wp.vec2(geom_view.eye[right], -geom_view.eye[low])
    texture_map.facing = -(wp.transpose(geom_view.into) @ normal)
    return texture_map
