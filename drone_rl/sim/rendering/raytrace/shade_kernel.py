"""Color of what a pixel shows: light on the corners of triangles, textures, transparent surfaces.

Colors of corners are kept until the image is done, in a table with a place for each key's hash.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, Hit, World, cast
from drone_rl.sim.rendering.raytrace.corners_kernel import (
    Cell,
    Face,
    find_cell,
    find_corner,
    grid_face,
    is_tiny,
)
from drone_rl.sim.rendering.raytrace.intersection_kernel import PLANE
from drone_rl.sim.rendering.raytrace.light_kernel import (
    Look,
    Shot,
    finish,
    light_point,
    sky,
)
from drone_rl.sim.rendering.raytrace.shadows_kernel import (
    Shadows,
    is_in_shadow,
    set_point,
    start_block,
)
from drone_rl.sim.rendering.raytrace.structs_kernel import NO_GEOM, struct
from drone_rl.sim.rendering.raytrace.surfaces_kernel import (
    CUBE,
    WRAPPED,
    Mapping,
    Surfaces,
    is_around,
    texture_place,
)
from drone_rl.sim.rendering.raytrace.texels_kernel import (
    Image,
    Textures,
    get_image,
    sample_cube,
    sample_flat,
)
from drone_rl.sim.rendering.raytrace.triangles_kernel import (
    Triangles,
    triangle_corner,
    triangle_weights,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

OPAQUE = wp.constant(0.995)
"""Opacity from which OpenGL lets nothing through."""
_LAYERS = wp.constant(4)
"""Transparent surfaces that a ray passes."""
_OFF = wp.constant(1e-4)
"""How far behind a transparent surface a ray goes on, relative to its length."""
_FROM_BEHIND = wp.constant(0.3)
"""Factor of the opacity of planes that are seen from behind."""


@struct
class Surface:
    """A face of a geom and its material."""

    number: int
    """Of the geom, in the model."""
    face: Face
    axes: wp.mat33
    """Rotates directions from the geom's frame to the world's."""
    center: wp.vec3
    """The geom's position, world frame."""
    color: wp.vec3
    opacity: float
    shine: wp.vec3
    """See `Surfaces`."""
    mapping: Mapping
    image: Image
    """Its texture, if any."""


@struct
class Point:
    """A point of a surface that a pixel shows, geom's frame."""

    local: wp.vec3
    ray: wp.vec3
    """From the camera, with length 1 along its axis."""
    depth: float
    """Metres along the camera's axis."""
    normal: wp.vec3
    """Of the surface."""
    smooth: wp.vec3
    """Unit normal for shading; of a mesh, interpolated."""
    weights: wp.vec3
    """Of the corners of a mesh's triangle."""


@wp.func
def make_surface(
    surfaces: Surfaces,
    textures: Textures,
    shot: Shot,
    number: int,
    kind: int,
    part: int,
    size: wp.vec3,
    axes: wp.mat33,
    eye: wp.vec3,
    normal: wp.vec3,
) -> Surface:
    """Return a face of a geom; `eye` is the camera and `normal` the face's, geom's frame."""
    made = Surface()
    made.number = number
    made.axes = axes
    made.center = shot.position - axes @ eye
    made.face = grid_face(
        kind,
        part,
        size,
        normal,
        surfaces.cells[number],
        surfaces.counts[number],
        eye,
        surfaces.divisions,
        surfaces.slices,
        surfaces.stacks,
    )
    rgba = surfaces.color[shot.env % surfaces.color.shape[0], number]
    made.color = wp.vec3(rgba[0], rgba[1], rgba[2])
    made.opacity = rgba[3]
    if kind == PLANE and eye[2] < 0.0:
        made.opacity *= _FROM_BEHIND
        made.face.normal = wp.vec3(0.0, 0.0, 1.0)
    made.shine = surfaces.shine[number]
    row = shot.env % surfaces.texture.shape[0]
    made.mapping.texture = surfaces.texture[row, number]
    if made.mapping.texture >= 0:
        made.mapping.kind = surfaces.mapping[row, number]
        made.mapping.scale = surfaces.scale[row, number]
        made.mapping.shift = surfaces.shift[number]
        made.image = get_image(textures, made.mapping.texture)
    return made


@wp.func
def shade(
    look: Look,
    world: World,
    hit: Hit,
    direction: wp.vec3,
    shot: Shot,
    shadows: Shadows,
    faces: wp.array[Surface],
) -> wp.vec3:
    """Return the color, 0 to 1, of what a ray hits, and of what is behind transparent surfaces.

    `direction` is that of the ray, world frame. `faces` is working memory: 1 is overwritten.
    """
    cosine = wp.dot(direction, shot.forward)
    total = wp.vec3()
    left = float(1.0)
    layer = int(0)
    behind = hit
    passed = float(0.0)
    while layer < _LAYERS and behind.geom != NO_GEOM:
        back = wp.transpose(behind.axes)
        whole = passed + behind.distance
        eye = behind.local - whole * (back @ direction)
        faces[1] = make_surface(
            look.surfaces,
            look.textures,
            shot,
            behind.geom,
            behind.kind,
            behind.part,
            behind.size,
            behind.axes,
            eye,
            behind.local_normal,
        )
        point = Point()
        point.local = behind.local
        point.ray = back @ direction / cosine
        point.depth = whole * cosine
        point.normal = behind.local_normal
        point.smooth = back @ behind.normal
        if behind.kind == PLANE:
            point.smooth = faces[1].face.normal
        if behind.kind == MESH:
            point.weights = triangle_weights(world.triangles, behind.part, eye, back @ direction)
        opacity = float(faces[1].opacity)
        is_clear = opacity < OPAQUE and layer + 1 < _LAYERS
        if not is_clear and shot.num_casting > 0:
            start_block(shadows, 1)
            place = whole * direction
            set_point(shadows, 1, 0, place, faces[1].axes @ point.normal, whole)
        color = find_light(world.triangles, faces, 1, point, shot, not is_clear)
        if not is_clear and shot.num_casting > 0:
            color = add_casting(world, shadows, 1, 0, shot, color)
        texel = sample_surface(look.textures.texels, world.triangles, faces, 1, point, shot)
        color = wp.cw_mul(color, texel)
        color = finish(color, whole, shot)
        if is_clear:
            # OpenGL blends each transparent geom twice, from front to back and then back to front
            share = opacity * (2.0 - opacity)
            total += left * share * color
            left *= 1.0 - share
            passed = whole + _OFF * (1.0 + passed)
            beyond = shot.position + passed * direction
            behind = cast(world, shot.env, beyond, direction, shot.far / cosine - passed)
            layer += 1
        else:
            total += left * color
            left = 0.0
            layer = _LAYERS
    if left > 0.0:
        total += left * sky(look.textures.texels, direction, shot)
    return total


@wp.func
def add_casting(
    world: World, shadows: Shadows, block: int, number: int, shot: Shot, total: wp.vec3
) -> wp.vec3:
    """Add the light of `Shot.lit` that reaches a point, `number` of a block of shadows."""
    group = int(0)
    light = int(0)
    while light < shot.count:
        if shot.lights[light].casts != 0:
            group += 1
            lit = shot.lit[group]
            if wp.length_sq(lit) > 0.0 and not is_in_shadow(
                world, shadows, block, number, shot, light
            ):
                total += lit
        light += 1
    return total


@wp.func
def find_light(
    triangles: Triangles,
    faces: wp.array[Surface],
    which: int,
    point: Point,
    shot: Shot,
    has_shadows: bool,
) -> wp.vec3:
    """Return the light that a point reflects without shadows.

    If any light casts them, that of each such light is written to `Shot.lit`, see `add_casting`.
    """
    pixel = point.depth * shot.pixel
    cell = Cell()
    if faces[which].face.kind == MESH:
        cell = _mesh_cell(triangles, faces[which].face.part, pixel, point.weights)
    else:
        cell = find_cell(faces[which].face, point.local, pixel)
    if cell.count == 1:
        _light_place(faces[which], point.local, point.smooth, shot, has_shadows, shot.lit, 0)
        return wp.vec3(shot.lit[0])
    groups = int(1)
    scope = -2 - faces[which].number
    if has_shadows:
        groups += shot.num_casting
        scope = faces[which].number
    part = 8 * faces[which].face.part + cell.side
    total = wp.vec3()
    group = int(1)
    while group < groups:
        shot.lit[group] = wp.vec3()
        group += 1
    for corner in range(3):
        key = wp.vec4i(scope, part, cell.x[corner], cell.y[corner])
        at = _hash(key) & (shot.keys.shape[0] - 1)
        first = at * (1 + shot.num_casting)
        if not _is_same(shot.keys[at], key):
            place, normal = _corner(triangles, faces[which].face, cell.side, key[2], key[3])
            _light_place(faces[which], place, normal, shot, has_shadows, shot.known, first)
            shot.keys[at] = key
        total += cell.weights[corner] * shot.known[first]
        of = int(1)
        while of < groups:
            shot.lit[of] = shot.lit[of] + cell.weights[corner] * shot.known[first + of]
            of += 1
    return total


@wp.func
def _mesh_cell(triangles: Triangles, triangle: int, pixel: float, weights: wp.vec3) -> Cell:
    cell = Cell()
    cell.count = 1
    first = triangle_corner(triangles, triangle, 0)
    if not is_tiny(first, triangle_corner(triangles, triangle, 1), pixel):
        cell.count = 3
        cell.x = wp.vec3i(0, 1, 2)
        cell.weights = weights
    return cell


@wp.func
def _corner(triangles: Triangles, face: Face, side: int, x: int, y: int) -> tuple[wp.vec3, wp.vec3]:
    """Return place and normal of a corner, geom's frame."""
    if face.kind == MESH:
        place = triangle_corner(triangles, face.part, x)
        return place, wp.vec3(triangles.normals[3 * face.part + x])
    place, normal = find_corner(face, side, x, y)
    return place, normal


@wp.func
def _light_place(
    surface: Surface,
    place: wp.vec3,
    normal: wp.vec3,
    shot: Shot,
    has_shadows: bool,
    lit: wp.array[wp.vec3],
    first: int,
) -> None:
    """Write the light of each group at a place of a surface, geom's frame, from `first` on."""
    group = int(first)
    light = int(-1)
    while light < shot.count:
        if light < 0 or (has_shadows and shot.lights[light].casts != 0):
            lit[group] = light_point(
                shot.lights,
                shot.count,
                light,
                has_shadows,
                shot.ambient,
                shot.position,
                surface.center + surface.axes @ place,
                surface.axes @ normal,
                surface.color,
                surface.shine,
            )
            group += 1
        light += 1


@wp.func_native("""
unsigned mixed = (unsigned)key[0] * 73856093u ^ (unsigned)key[1] * 19349663u;
mixed = (mixed ^ (mixed >> 15)) * 2246822519u;
mixed ^= (unsigned)key[2] * 83492791u ^ (unsigned)key[3] * 2654435761u;
return (int)(mixed ^ (mixed >> 13));
""")
def _hash(key: wp.vec4i) -> int:
    """Return a number that differs between most keys."""
    ...


@wp.func_native("return a[0] == b[0] && a[1] == b[1] && a[2] == b[2] && a[3] == b[3];")
def _is_same(a: wp.vec4i, b: wp.vec4i) -> bool:
    """Return whether two keys are the same; Warp does not compare vectors."""
    ...


@wp.func
def sample_surface(
    texels: wp.array[wp.uint32],
    triangles: Triangles,
    faces: wp.array[Surface],
    which: int,
    point: Point,
    shot: Shot,
) -> wp.vec3:
    """Return the color of a surface's texture, 0 to 1, where a pixel shows it; white for none."""
    if faces[which].mapping.texture < 0:
        return wp.vec3(1.0, 1.0, 1.0)
    surface = faces[which]
    normal, back = point.normal, point.depth * wp.transpose(surface.axes)
    along_normal = normal / wp.dot(normal, point.ray)
    across, down = back @ shot.right, back @ shot.down
    across = across - wp.dot(along_normal, across) * point.ray
    down = down - wp.dot(along_normal, down) * point.ray
    here, right, below = wp.vec3(), wp.vec3(), wp.vec3()
    mapping, face = surface.mapping, surface.face
    if face.kind == MESH and mapping.kind == WRAPPED:
        here = _mesh_place(triangles, face.part, mapping, point.local)
        right = _mesh_place(triangles, face.part, mapping, point.local + across) - here
        below = _mesh_place(triangles, face.part, mapping, point.local + down) - here
    else:
        kind, part, size = face.kind, face.part, face.size
        here = texture_place(mapping, kind, part, size, normal, point.local)
        right = texture_place(mapping, kind, part, size, normal, point.local + across) - here
        below = texture_place(mapping, kind, part, size, normal, point.local + down) - here
    if mapping.kind == CUBE:
        return sample_cube(texels, surface.image, here, right, below)
    if is_around(mapping, face.kind, face.part):  # across the seam
        turn = mapping.scale[0]
        right[0] = right[0] - wp.round(right[0] / turn) * turn
        below[0] = below[0] - wp.round(below[0] / turn) * turn
    return sample_flat(texels, surface.image, here, right, below)


@wp.func
def _mesh_place(triangles: Triangles, triangle: int, mapping: Mapping, place: wp.vec3) -> wp.vec3:
    """Return the texture coordinates of a mesh at a place on a triangle's plane."""
    a = triangle_corner(triangles, triangle, 0)
    one = triangle_corner(triangles, triangle, 1) - a
    two = triangle_corner(triangles, triangle, 2) - a
    at = place - a
    xx, xy, yy = wp.dot(one, one), wp.dot(one, two), wp.dot(two, two)
    x, y = wp.dot(at, one), wp.dot(at, two)
    area = wp.max(xx * yy - xy * xy, 1e-30)
    second, third = (yy * x - xy * y) / area, (xx * y - xy * x) / area
    here = (1.0 - second - third) * triangles.texcoords[3 * triangle]
    here += second * triangles.texcoords[3 * triangle + 1]
    here += third * triangles.texcoords[3 * triangle + 2]
    scale, shift = mapping.scale, mapping.shift
    return wp.vec3(here[0] * scale[0] + shift[0], here[1] * scale[1] + shift[1], 0.0)
