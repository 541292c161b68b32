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
"""What is seen of sky and geoms where there is more than flat colours: textures, shadows, fog."""

import warp as wp

from drone_rl.sim.rendering.raytrace.shading import Cover, shade_covered, shade_even, shade_sky
from drone_rl.sim.rendering.raytrace.sight import upward
from drone_rl.sim.rendering.raytrace.solids import ROUND
from drone_rl.sim.rendering.raytrace.structs import Camera, Looks, Poses, Scenery, Sight, View


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
