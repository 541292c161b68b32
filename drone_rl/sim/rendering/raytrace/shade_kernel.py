"""Color of what a pixel shows: light on the corners of triangles, textures, transparent surfaces.

Colors of corners are kept until the image is done, in a table with a place for each key's hash.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, Hit, World, cast
from drone_rl.sim.rendering.raytrace.corners_kernel import (
    LIT,
    NEW,
    SMALL,
    Face,
    Patch,
    find_cell,
    find_corner,
    grid_face,
    place_rectangle,
    place_triangle,
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
    smooth_normal,
    triangle_corner,
    triangle_normal,
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
    patch: Patch
    """Of a flat face: what was lit last."""
    is_simple: bool
    """Whether `shade_patch` shades it: it is opaque and has patches on which textures are even."""
    right: wp.vec3
    """Step between pixels at distance 1 along the camera's axis, geom's frame."""
    down: wp.vec3


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
    back = wp.transpose(axes)
    made.right = back @ shot.right
    made.down = back @ shot.down
    return made


@wp.func
def start_face(triangles: Triangles, faces: wp.array[Surface], which: int, part: int) -> None:
    """Prepare `faces[which]`, which `make_surface` made, for points of a face or triangle."""
    kind = faces[which].face.kind
    patch = Patch()
    if kind == MESH:
        faces[which].face.part = part
        faces[which].face.normal = triangle_normal(triangles, part)
        patch = place_triangle(triangles, part)
    faces[which].patch = patch
    mapping, face = faces[which].mapping, faces[which].face
    if mapping.texture >= 0 and mapping.kind != CUBE and not face.is_round:
        faces[which].mapping = _even_mapping(triangles, face, mapping, patch)
    is_even = mapping.texture < 0 or faces[which].mapping.is_even
    faces[which].is_simple = face.has_patches and is_even and faces[which].opacity >= OPAQUE


@wp.func
def _even_mapping(triangles: Triangles, face: Face, mapping: Mapping, patch: Patch) -> Mapping:
    """Return how a texture lies on a flat face or a triangle; see `Mapping.is_even`."""
    made = mapping
    made.is_even = True
    if face.kind == MESH and mapping.kind == WRAPPED:
        first = triangles.texcoords[3 * face.part]
        one = triangles.texcoords[3 * face.part + 1] - first
        two = triangles.texcoords[3 * face.part + 2] - first
        scale, shift = mapping.scale, mapping.shift
        origin = first + patch.shift[0] * one + patch.shift[1] * two
        made.start = wp.cw_mul(origin, wp.vec2(scale[0], scale[1])) + shift
        made.across = scale[0] * (one[0] * patch.across + two[0] * patch.up)
        made.down = scale[1] * (one[1] * patch.across + two[1] * patch.up)
        return made
    start = texture_place(mapping, face.kind, face.part, face.size, face.normal, wp.vec3())
    made.start = wp.vec2(start[0], start[1])
    for axis in range(3):
        unit = wp.vec3()
        unit[axis] = 1.0
        step = texture_place(mapping, face.kind, face.part, face.size, face.normal, unit) - start
        made.across[axis] = step[0]
        made.down[axis] = step[1]
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
        start_face(world.triangles, faces, 1, behind.part)
        point = Point()
        point.local = behind.local
        point.ray = back @ direction / cosine
        point.depth = whole * cosine
        point.normal = behind.local_normal
        opacity = float(faces[1].opacity)
        is_clear = opacity < OPAQUE and layer + 1 < _LAYERS
        if not is_clear and shot.num_casting > 0:
            start_block(shadows, 1)
            place = whole * direction
            set_point(shadows, 1, 0, place, faces[1].axes @ point.normal, whole)
        color = find_light(world.triangles, faces, 1, point, shot, not is_clear)
        if not is_clear and shot.num_casting > 0:
            color = add_casting(world, shadows, 1, 0, shot, color)
        texel = sample_surface(look.textures.texels, faces, 1, point)
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
        total += left * sky(look.textures.texels, direction / cosine, shot)
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
    kind = faces[which].face.kind
    if not faces[which].face.has_patches:
        return _light_cell(triangles, faces, which, point, shot, has_shadows)
    is_lit = reach_patch(triangles, faces, which, point, shot, has_shadows)
    x, y = _coordinates(faces, which, point.local)
    if not is_lit:
        normal = faces[which].face.normal
        if kind == MESH:
            weights = wp.vec3(1.0 - x - y, x, y)
            normal = smooth_normal(triangles, faces[which].face.part, weights)
        _light_place(faces[which], point.local, normal, shot, has_shadows, shot.lit, 0)
        return wp.vec3(shot.lit[0])
    first = 6 * which * (1 + shot.num_casting)
    if wp.dot(faces[which].patch.cut, wp.vec3(x, y, 1.0)) > 0.0:
        first += 3
    group = int(0)
    while group < _groups(shot, has_shadows):
        at = first + 6 * group
        shot.lit[group] = shot.slopes[at] + x * shot.slopes[at + 1] + y * shot.slopes[at + 2]
        group += 1
    return wp.vec3(shot.lit[0])


@wp.func
def reach_patch(
    triangles: Triangles,
    faces: wp.array[Surface],
    which: int,
    point: Point,
    shot: Shot,
    has_shadows: bool,
) -> bool:
    """Make the patch of a face that of a point, and light it; False if it is too small for that."""
    x, y = _coordinates(faces, which, point.local)
    is_new = faces[which].patch.state == NEW or _is_out(x) or _is_out(y)
    if is_new and faces[which].face.kind != MESH:
        faces[which].patch = place_rectangle(faces[which].face, point.local)
    if faces[which].patch.edge < SMALL * point.depth * shot.pixel:
        return False
    if faces[which].patch.state != LIT:
        first = 6 * which * (1 + shot.num_casting)
        _light_patch(triangles, faces, which, shot, has_shadows, first)
        faces[which].patch.state = LIT
    return True


@wp.func
def _coordinates(faces: wp.array[Surface], which: int, local: wp.vec3) -> tuple[float, float]:
    """Return the coordinates of a place on the patch of a face; see `Patch`."""
    x = wp.dot(faces[which].patch.across, local) + faces[which].patch.shift[0]
    y = wp.dot(faces[which].patch.up, local) + faces[which].patch.shift[1]
    return x, y


@wp.func
def _is_out(coordinate: float) -> bool:
    return coordinate < 0.0 or coordinate > 1.0


@wp.func
def _groups(shot: Shot, has_shadows: bool) -> int:
    """Return the number of groups of lights; see `Shot.lit`."""
    if has_shadows:
        return 1 + shot.num_casting
    return 1


@wp.func
def _light_patch(
    triangles: Triangles,
    faces: wp.array[Surface],
    which: int,
    shot: Shot,
    has_shadows: bool,
    first: int,
) -> None:
    """Light the corners of a patch and write its `Shot.slopes` from `first` on."""
    groups = _groups(shot, has_shadows)
    corners = int(4)
    if faces[which].face.kind == MESH:
        corners = 3
    corner = int(0)
    while corner < corners:
        x, y = int(corner), int(0)
        if corners == 4:
            x = faces[which].patch.column + corner % 2
            y = faces[which].patch.row + corner // 2
        known = _light_corner(triangles, faces, which, 0, x, y, shot, has_shadows)
        group = int(0)
        while group < groups:
            shot.slopes[first + 6 * group + corner] = shot.known[known + group]
            group += 1
        corner += 1
    group = int(0)
    while group < groups:
        at = first + 6 * group
        base, right = wp.vec3(shot.slopes[at]), wp.vec3(shot.slopes[at + 1])
        above, last = wp.vec3(shot.slopes[at + 2]), wp.vec3(shot.slopes[at + 3])
        shot.slopes[at + 1] = right - base
        if faces[which].face.is_main:  # from the first to the last corner
            shot.slopes[at + 2] = last - right
            shot.slopes[at + 3] = base
            shot.slopes[at + 4] = last - above
            shot.slopes[at + 5] = above - base
        else:
            shot.slopes[at + 2] = above - base
            shot.slopes[at + 3] = right + above - last
            shot.slopes[at + 4] = last - above
            shot.slopes[at + 5] = last - right
        group += 1


@wp.func
def _light_cell(
    triangles: Triangles,
    faces: wp.array[Surface],
    which: int,
    point: Point,
    shot: Shot,
    has_shadows: bool,
) -> wp.vec3:
    """Return the light on a round solid; see `find_light`."""
    cell = find_cell(faces[which].face, point.local, point.depth * shot.pixel)
    if cell.count == 1:
        _light_place(faces[which], point.local, point.normal, shot, has_shadows, shot.lit, 0)
        return wp.vec3(shot.lit[0])
    group = int(0)
    while group < _groups(shot, has_shadows):
        shot.lit[group] = wp.vec3()
        group += 1
    for corner in range(3):
        x, y = cell.x[corner], cell.y[corner]
        known = _light_corner(triangles, faces, which, cell.side, x, y, shot, has_shadows)
        of = int(0)
        while of < _groups(shot, has_shadows):
            shot.lit[of] = shot.lit[of] + cell.weights[corner] * shot.known[known + of]
            of += 1
    return wp.vec3(shot.lit[0])


@wp.func
def _light_corner(
    triangles: Triangles,
    faces: wp.array[Surface],
    which: int,
    side: int,
    x: int,
    y: int,
    shot: Shot,
    has_shadows: bool,
) -> int:
    """Return where `Shot.known` has the light on a corner of a face's grid."""
    scope = faces[which].number
    if not has_shadows:
        scope = -2 - scope
    key = wp.vec4i(scope, 8 * faces[which].face.part + side, x, y)
    at = _hash(key) & (shot.keys.shape[0] - 1)
    first = at * (1 + shot.num_casting)
    if not _is_same(shot.keys[at], key):
        place, normal = _corner(triangles, faces[which].face, side, x, y)
        _light_place(faces[which], place, normal, shot, has_shadows, shot.known, first)
        shot.keys[at] = key
    return first


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
    faces: wp.array[Surface],
    which: int,
    point: Point,
) -> wp.vec3:
    """Return the color of a surface's texture, 0 to 1, where a pixel shows it; white for none."""
    if faces[which].mapping.texture < 0:
        return wp.vec3(1.0, 1.0, 1.0)
    normal, image = point.normal, faces[which].image
    along_normal = normal / wp.dot(normal, point.ray)
    across, down = point.depth * faces[which].right, point.depth * faces[which].down
    across = across - wp.dot(along_normal, across) * point.ray
    down = down - wp.dot(along_normal, down) * point.ray
    if faces[which].mapping.is_even:
        u, v = faces[which].mapping.across, faces[which].mapping.down
        start = faces[which].mapping.start
        place = wp.vec3(wp.dot(u, point.local) + start[0], wp.dot(v, point.local) + start[1], 0.0)
        one = wp.vec3(wp.dot(u, across), wp.dot(v, across), 0.0)
        two = wp.vec3(wp.dot(u, down), wp.dot(v, down), 0.0)
        return sample_flat(texels, image, place, one, two)
    mapping, kind = faces[which].mapping, faces[which].face.kind
    part, size = faces[which].face.part, faces[which].face.size
    here = texture_place(mapping, kind, part, size, normal, point.local)
    right = texture_place(mapping, kind, part, size, normal, point.local + across) - here
    below = texture_place(mapping, kind, part, size, normal, point.local + down) - here
    if mapping.kind == CUBE:
        return sample_cube(texels, image, here, right, below)
    if is_around(mapping, kind, part):  # across the seam
        turn = mapping.scale[0]
        right[0] = right[0] - wp.round(right[0] / turn) * turn
        below[0] = below[0] - wp.round(below[0] / turn) * turn
    return sample_flat(texels, image, here, right, below)
