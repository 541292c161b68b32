"""Shadows on the pixels of a tile, all at once for each light.

Geoms that the hull of the tile's points and the light cannot meet are skipped; those that are left
test the rays of all pixels, as when they are drawn.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.canvas_kernel import SOLID, START, of_each_kind
from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, World
from drone_rl.sim.rendering.raytrace.intersection_kernel import PLANE
from drone_rl.sim.rendering.raytrace.light_kernel import DIRECTIONAL, MOST_LIGHTS, PlacedLight, Shot
from drone_rl.sim.rendering.raytrace.structs_kernel import GeomView, struct
from drone_rl.sim.rendering.raytrace.triangles_kernel import trace_mesh

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

PIXELS = wp.constant(64)
"""Points of a block: the pixels of a tile."""
_OFF = wp.constant(1e-4)
"""How far off a surface rays to lights start, relative to the distance from the camera."""
_FAR = wp.constant(1e6)
"""Length of rays to directional lights, metres."""


@struct
class Shadows:
    """Two blocks of points: the pixels of a tile, and a point behind transparent surfaces."""

    geoms: wp.array[GeomView]
    boxes: wp.array[float]
    """Of each geom, parallel to the world's axes, relative to the camera: low and high corner."""
    points: wp.array[float]
    """Of each block: x, y, z of all points, relative to the camera, and of their normals.

    A point without a normal is none.
    """
    blocked: wp.array[int]
    """Of each block and light: whether a geom is between a point and the light."""
    is_known: wp.array[int]
    """Whether that is known, of each block and light."""
    meshes: wp.array[int]
    """Geoms, while they are found."""


@wp.func_native("""
for (int g = 0; g < count; ++g) {
    const auto &geom = shadows.geoms.data[g];
    for (int c = 0; c < 3; ++c) {
        float middle = 0.0f, half = 0.0f;
        for (int r = 0; r < 3; ++r) {
            middle -= geom.axes.data[c][r] * geom.eye[r];
            half += wp::abs(geom.axes.data[c][r]) * geom.reach[r];
        }
        shadows.boxes.data[6 * g + c] = middle - half;
        shadows.boxes.data[6 * g + 3 + c] = middle + half;
    }
}
for (int i = 0; i < 768; ++i) shadows.points.data[i] = 0.0f;
""")
def start_shadows(shadows: Shadows, count: int) -> None:
    """Find the boxes of all geoms, `count`, and clear both blocks."""
    ...


@wp.func
def start_block(shadows: Shadows, block: int) -> None:
    """Forget the shadows of a block."""
    light = int(0)
    while light < MOST_LIGHTS:
        shadows.is_known[block * MOST_LIGHTS + light] = 0
        light += 1


@wp.func
def set_point(
    shadows: Shadows, block: int, point: int, place: wp.vec3, normal: wp.vec3, far: float
) -> None:
    """Set a point, relative to the camera, which is `far` metres away; world frame."""
    start = place + _OFF * (1.0 + far) * normal
    for axis in range(3):
        at = (6 * block + axis) * PIXELS + point
        shadows.points[at] = start[axis]
        shadows.points[at + 3 * PIXELS] = normal[axis]


@wp.func
def is_in_shadow(
    world: World, shadows: Shadows, block: int, point: int, shot: Shot, light: int
) -> bool:
    """Return whether a point faces away from a light, or a geom is between both.

    Triangles and planes count from both sides, solids from outside.
    """
    row = block * MOST_LIGHTS + light
    if shadows.is_known[row] == 0:
        shadows.is_known[row] = 1
        placed = shot.lights[light]
        count = block_by_solids(shadows, world.geoms.kind.shape[0], row, placed, shot.position)
        i = int(0)
        while i < count:
            _block_by_mesh(world, shadows, shadows.meshes[i], row, placed, shot.position)
            i += 1
    return shadows.blocked[row * PIXELS + point] != 0


_SEGMENT = """
float enter = 0.0f, leave = 1.0f;
for (int r = 0; r < 3 && enter <= leave; ++r) {
    const float ax = m[0][r], ay = m[1][r], az = m[2][r];
    const float at = geom.eye[r] + ax * middle[0] + ay * middle[1] + az * middle[2];
    const float along = ax * path[0] + ay * path[1] + az * path[2];
    const float wide = wp::abs(ax) * half[0] + wp::abs(ay) * half[1] + wp::abs(az) * half[2];
    const float taper = is_far ? 0.0f : wide, reach = geom.reach[r] + wide + 1e-4f;
    for (int side = -1; side < 2; side += 2) {
        const float slope = side * along + taper, most = reach - side * at;
        if (slope > 0.0f) leave = wp::min(leave, most / slope);
        else if (slope < 0.0f) enter = wp::max(enter, most / slope);
        else if (most < 0.0f) leave = -1.0f;
    }
}
if (enter > leave * 1.00001f) continue;
"""
"""Skips a geom unless the points' box, which shrinks on its way to the light, may meet its box."""

_RAYS = """
#pragma clang loop vectorize(enable) interleave(disable)
for (int k = 0; k < 64; ++k) {
    const float u = m0 * tx[k] + m1 * ty[k] + m2 * tz[k];
    const float v = m3 * tx[k] + m4 * ty[k] + m5 * tz[k];
    const float w = m6 * tx[k] + m7 * ty[k] + m8 * tz[k];
    const float ex = x0 + m0 * s[k] + m1 * s[64 + k] + m2 * s[128 + k];
    const float ey = y0 + m3 * s[k] + m4 * s[64 + k] + m5 * s[128 + k];
    const float ez = z0 + m6 * s[k] + m7 * s[64 + k] + m8 * s[128 + k];
    START
    KIND
    (void)face;
    dark[k] |= is_hit & (along <= limit) & !is_inside;
}
""".replace("START", START)


@wp.func_native(f"""
const auto &light = placed;
const bool is_far = light.kind == {int(DIRECTIONAL)};
const float limit = is_far ? {float(_FAR)}f : 1.0f;
const wp::vec_t<3, float> to = is_far ? -light.direction : light.position - eye;
const float *const __restrict s = shadows.points.data + row / {int(MOST_LIGHTS)} * 384;
int *const __restrict dark = shadows.blocked.data + 64 * row;
float tx[64], ty[64], tz[64];
int is_lit = 0;
for (int k = 0; k < 64; ++k) {{
    tx[k] = is_far ? to[0] : to[0] - s[k];
    ty[k] = is_far ? to[1] : to[1] - s[64 + k];
    tz[k] = is_far ? to[2] : to[2] - s[128 + k];
    dark[k] = s[192 + k] * tx[k] + s[256 + k] * ty[k] + s[320 + k] * tz[k] <= 0.0f;
    is_lit |= !dark[k];
}}
if (!is_lit) return 0;
float middle[3], half[3], path[3], first[3], last[3];
for (int c = 0; c < 3; ++c) {{
    float low = 1e30f, high = -1e30f;
    for (int k = 0; k < 64; ++k) {{
        low = !dark[k] && s[64 * c + k] < low ? s[64 * c + k] : low;
        high = !dark[k] && s[64 * c + k] > high ? s[64 * c + k] : high;
    }}
    middle[c] = 0.5f * (low + high);
    half[c] = 0.5f * (high - low);
    path[c] = is_far ? limit * to[c] : to[c] - middle[c];
    first[c] = wp::min(low, is_far ? low + path[c] : to[c]) - 1e-4f;
    last[c] = wp::max(high, is_far ? high + path[c] : to[c]) + 1e-4f;
}}
int found = 0;
for (int number = 0; number < count; ++number) {{
    const auto &geom = shadows.geoms.data[number];
    const auto &m = geom.axes.data;
    if (geom.kind != {int(PLANE)}) {{
        const float *const box = shadows.boxes.data + 6 * number;
        if (box[0] > last[0] || box[3] < first[0] || box[1] > last[1] || box[4] < first[1]
            || box[2] > last[2] || box[5] < first[2]) continue;
        {_SEGMENT}
    }}
    if (geom.kind == {int(MESH)}) {{
        shadows.meshes.data[found++] = number;
        continue;
    }}
    {SOLID}
    const float m0 = rx * m[0][0], m1 = rx * m[1][0], m2 = rx * m[2][0];
    const float m3 = ry * m[0][1], m4 = ry * m[1][1], m5 = ry * m[2][1];
    const float m6 = rz * m[0][2], m7 = rz * m[1][2], m8 = rz * m[2][2];
    const float x0 = rx * geom.eye[0], y0 = ry * geom.eye[1], z0 = rz * geom.eye[2];
    {of_each_kind(_RAYS)}
    is_lit = 0;
    for (int k = 0; k < 64; ++k) is_lit |= !dark[k];
    if (!is_lit) return 0;
}}
return found;
""")
def block_by_solids(
    shadows: Shadows, count: int, row: int, placed: PlacedLight, eye: wp.vec3
) -> int:
    """Write which points of a row of `Shadows.blocked` face away from its light or are blocked.

    Return the number of meshes that remain to be tested: they are in `Shadows.meshes`.
    """
    ...


@wp.func
def _block_by_mesh(
    world: World, shadows: Shadows, geom: int, row: int, placed: PlacedLight, eye: wp.vec3
) -> None:
    seen = shadows.geoms[geom]
    back = wp.transpose(seen.axes)
    point = int(0)
    while point < PIXELS:
        if shadows.blocked[row * PIXELS + point] == 0:
            at = row // MOST_LIGHTS * 6 * PIXELS + point
            start = wp.vec3(
                shadows.points[at],
                shadows.points[at + PIXELS],
                shadows.points[at + 2 * PIXELS],
            )
            towards = -placed.direction
            limit = float(_FAR)
            if placed.kind != DIRECTIONAL:
                towards = placed.position - eye - start
                limit = 1.0
            origin, ray = seen.eye + back @ start, back @ towards
            mesh = world.mesh[geom]
            found = trace_mesh(world.triangles, mesh, origin, ray, limit, True, True)
            if found[0] >= 0.0:
                shadows.blocked[row * PIXELS + point] = 1
        point += 1
