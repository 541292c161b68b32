"""Drawing of geoms into tiles of 8 x 8 pixels, by the depth along the camera's axis.

A canvas has the pixels of a tile next to each other, so that compilers test eight rays at once. The
ray through pixel (i, j) is x = (i - x0) / x_scale, y = (y0 - j) / y_scale, z = -1 in the camera's
frame: what it meets at `t` has the depth t, and 1 / t changes evenly over a flat surface.

Solids test the rays of all tiles that they can be seen in. Meshes descend their hierarchy to nodes
that some pixel can show: those with no pixel's centre or behind what is drawn already are skipped,
so that the triangles of a distant mesh cost no more than the pixels that it covers.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    FAR_AWAY,
    PLANE,
    ROUND,
    SAME,
    SPHERE,
    UPPER,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import NEAR
from drone_rl.sim.rendering.raytrace.structs_kernel import NO_GEOM, GeomView, struct
from drone_rl.sim.rendering.raytrace.triangles_kernel import Triangles

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

TILE = 8
"""Edge of a tile, pixels."""


@struct
class Canvas:
    """One image in tiles, row by row; the last of a row or column may reach beyond the image."""

    width: int
    height: int
    across: int
    """Tiles in a row."""
    down: int
    x0: float
    """The camera's axis, in pixels: the centre of pixel 0 is at 0."""
    y0: float
    x_scale: float
    """Pixels across at depth 1."""
    y_scale: float
    far: float
    """Largest depth that is drawn, metres."""
    depth: wp.array[float]
    owner: wp.array[int]
    """Index of the rendered geom that a pixel shows."""
    part: wp.array[int]
    """Which face or triangle that is."""
    farthest: wp.array[float]
    """Largest depth of each tile, or more."""
    is_old: wp.array[int]
    """Whether a tile's `farthest` is larger than need be."""


@wp.func_native(f"""
for (int i = 0; i < 64 * canvas.across * canvas.down; ++i) {{
    canvas.depth.data[i] = {float(FAR_AWAY)}f;
    canvas.owner.data[i] = {int(NO_GEOM)};
}}
for (int tile = 0; tile < canvas.across * canvas.down; ++tile) {{
    const int left = tile % canvas.across * 8, top = tile / canvas.across * 8;
    canvas.farthest.data[tile] = {float(FAR_AWAY)}f;
    canvas.is_old.data[tile] = 0;
    if (left + 8 > canvas.width || top + 8 > canvas.height)
        for (int i = 0; i < 64; ++i)
            if (left + i % 8 >= canvas.width || top + i / 8 >= canvas.height)
                canvas.depth.data[64 * tile + i] = 0.0f;
}}""")
def clear(canvas: Canvas) -> None:
    """Show nothing; what lies beyond the image counts as drawn."""
    ...


_COPY = """
for (int row = 0; row < canvas.height; ++row)
    for (int column = 0; column < canvas.across; ++column) {
        const int tile = row / 8 * canvas.across + column, first = 8 * column;
        const int count = canvas.width - first < 8 ? canvas.width - first : 8;
        const int from = 64 * tile + row % 8 * 8, to = row * canvas.width + first;
        for (int c = 0; c < count; ++c) PIXEL
    }
"""
_DEPTH = """{
    const float x = (first + c - canvas.x0) / canvas.x_scale;
    const float y = (row - canvas.y0) / canvas.y_scale;
    const float along = is_along_ray ? sqrtf(1.0f + x * x + y * y) : 1.0f;
    const float depth = canvas.depth.data[from + c];
    values.data[to + c] = depth < 1e9f ? depth * along : 0.0f;
}"""
_OWNER = """{
    const int owner = canvas.owner.data[from + c];
    values.data[to + c] = owner < 0 ? -1 : numbers.data[owner];
}"""


@wp.func_native(_COPY.replace("PIXEL", _DEPTH))
def copy_depths(canvas: Canvas, values: wp.array[float], is_along_ray: bool) -> None:
    """Write depths, or distances along each pixel's ray, row by row; 0 where nothing is shown."""
    ...


@wp.func_native(_COPY.replace("PIXEL", _OWNER))
def copy_owners(canvas: Canvas, numbers: wp.array[int], values: wp.array[int]) -> None:
    """Write the numbers of geoms, row by row; -1 where nothing is shown."""
    ...


@wp.func_native("""
const int left = tile % canvas.across * 8, top = tile / canvas.across * 8;
const int wide = canvas.width - left < 8 ? canvas.width - left : 8;
const int tall = canvas.height - top < 8 ? canvas.height - top : 8;
const float *const __restrict from = (const float *)colors.data;
unsigned char bytes[192];
for (int i = 0; i < 192; ++i) bytes[i] = (unsigned char)(int)(255.0f * from[i]);
for (int row = 0; row < tall; ++row) {
    auto *const to = (unsigned char *)(pixels.data + (top + row) * canvas.width + left);
    for (int i = 0; i < 3 * wide; ++i) to[i] = bytes[24 * row + i];
}""")
def copy_colors(
    canvas: Canvas, tile: int, colors: wp.array[wp.vec3], pixels: wp.array[wp.vec3ub]
) -> None:
    """Write the colors of a tile, 0 to 1, to an image, rounded down to bytes."""
    ...


AXES = """
const auto &m = geom.into.data;
const float x_scale = canvas.x_scale, y_scale = canvas.y_scale;
const float ex = geom.eye[0], ey = geom.eye[1], ez = geom.eye[2];
"""
"""The camera's attitude `m` and position in the frame of a geom."""

_BOUNDS = f"""
{AXES}
float x[8], y[8], z[8];
for (int k = 0; k < 8; ++k) {{
    const float px = (k & 1 ? geom.reach[0] : -geom.reach[0]) - ex;
    const float py = (k & 2 ? geom.reach[1] : -geom.reach[1]) - ey;
    const float pz = (k & 4 ? geom.reach[2] : -geom.reach[2]) - ez;
    x[k] = x_scale * (m[0][0] * px + m[1][0] * py + m[2][0] * pz);
    y[k] = -y_scale * (m[0][1] * px + m[1][1] * py + m[2][1] * pz);
    z[k] = -(m[0][2] * px + m[1][2] * py + m[2][2] * pz);
}}
const float front = {float(NEAR)}f;
float left = 1e9f, right = -1e9f, top = 1e9f, bottom = -1e9f, nearest = 1e30f;
const auto see = [&](float a, float b, float c) {{
    const float u = a / c, v = b / c;
    left = u < left ? u : left;
    right = u > right ? u : right;
    top = v < top ? v : top;
    bottom = v > bottom ? v : bottom;
}};
bool is_cut = false;
for (int k = 0; k < 8; ++k) {{
    nearest = z[k] < nearest ? z[k] : nearest;
    if (z[k] >= front) see(x[k], y[k], z[k]);
    else is_cut = true;
}}
if (is_cut)
    for (int k = 0; k < 8; ++k)
        for (int bit = 1; bit < 8; bit *= 2) {{
            const int other = k ^ bit;
            if (z[k] >= front && z[other] < front) {{
                const float share = (z[k] - front) / (z[k] - z[other]);
                see(x[k] + share * (x[other] - x[k]), y[k] + share * (y[other] - y[k]), front);
            }}
        }}
const float slack = 0.002f;
left = wp::max(left + canvas.x0 - slack, 0.0f);
right = wp::min(right + canvas.x0 + slack, canvas.width - 1.0f);
top = wp::max(top + canvas.y0 - slack, 0.0f);
bottom = wp::min(bottom + canvas.y0 + slack, canvas.height - 1.0f);
const bool is_seen = nearest <= canvas.far && left <= right && top <= bottom;
if (!is_seen) return wp::vec_t<4, int>(0, -1, 0, -1);
return wp::vec_t<4, int>((int)ceilf(left), (int)right, (int)ceilf(top), (int)bottom);
"""


@wp.func_native(_BOUNDS)
def bounds(canvas: Canvas, geom: GeomView) -> wp.vec4i:
    """Return the first and last column and the first and last row of pixels of a geom's box."""
    ...


@wp.func_native(f"""
{AXES}
float depth = m[0][2] * ex + m[1][2] * ey + m[2][2] * ez;
for (int c = 0; c < 3; ++c) depth -= wp::abs(m[c][2]) * geom.reach[c];
return wp::max(depth, 0.0f);
""")
def least_depth(canvas: Canvas, geom: GeomView) -> float:
    """Return the least depth of a geom's box."""
    ...


@wp.func_native("""
for (int gap = count / 2; gap > 0; gap /= 2)
    for (int i = gap; i < count; ++i) {
        const int moved = order.data[i];
        int j = i;
        for (; j >= gap && keys.data[order.data[j - gap]] > keys.data[moved]; j -= gap)
            order.data[j] = order.data[j - gap];
        order.data[j] = moved;
    }""")
def sort(order: wp.array[int], keys: wp.array[float], count: int) -> None:
    """Sort the first `count` indices by their keys."""
    ...


_PLANE = """
const float along = -ez / (wp::abs(w) > 1e-20f ? w : 1e-20f);
const bool on_x = (sx <= 0.0f) | (wp::abs(ex + along * u) <= sx);
const bool on_y = (sy <= 0.0f) | (wp::abs(ey + along * v) <= sy);
const bool is_hit = on_x & on_y & (along > 0.0f);
const int face = UPPER;
"""
_BOX = """
const float pu = 1.0f / (wp::abs(u) > 1e-20f ? u : 1e-20f);
const float pv = 1.0f / (wp::abs(v) > 1e-20f ? v : 1e-20f);
const float pw = 1.0f / (wp::abs(w) > 1e-20f ? w : 1e-20f);
const float hu = sx * wp::abs(pu), hv = sy * wp::abs(pv), hw = sz * wp::abs(pw);
const float mu = -ex * pu, mv = -ey * pv, mw = -ez * pw;
const float iu = mu - hu, iv = mv - hv, iw = mw - hw;
const float ou = mu + hu, ov = mv + hv, ow = mw + hw;
const float uv = iu > iv ? iu : iv, along = uv > iw ? uv : iw;
const float out_uv = ou < ov ? ou : ov, out = out_uv < ow ? out_uv : ow;
const bool is_hit = (along <= out) & (along >= 0.0f);
const int face_uv = iu > iv ? (u < 0.0f ? 1 : 0) : (v < 0.0f ? 3 : 2);
const int face = uv > iw ? face_uv : (w < 0.0f ? 5 : 4);
"""
_BALL = """
const float a = u * u + v * v + w * w, b = u * ex + v * ey + w * ez;
const float inside = b * b - a * c0;
const float root = sqrtf(inside > 0.0f ? inside : 0.0f);
const float along = (-b - root) / a;
const bool is_hit = (inside > 0.0f) & (along >= 0.0f);
const int face = ROUND;
"""
_TUBE = """
const float a = u * u + v * v, b = u * ex + v * ey;
const float inside = b * b - a * c0;
const float root = sqrtf(inside > 0.0f ? inside : 0.0f), per = 1.0f / (a > 1e-20f ? a : 1e-20f);
const bool is_steep = a <= 1e-20f;
const float tube_in = is_steep ? (c0 > 0.0f ? 1e20f : -1e20f) : (-b - root) * per;
const float tube_out = is_steep ? 1e20f : (-b + root) * per;
"""
_CYLINDER = f"""
{_TUBE}
const float pw = 1.0f / (wp::abs(w) > 1e-20f ? w : 1e-20f);
const float ends_in = -ez * pw - sy * wp::abs(pw), ends_out = -ez * pw + sy * wp::abs(pw);
const float along = tube_in > ends_in ? tube_in : ends_in;
const float out = tube_out < ends_out ? tube_out : ends_out;
const bool is_hit = (is_steep | (inside > 0.0f)) & (along <= out) & (along >= 0.0f);
const int face = tube_in > ends_in ? ROUND : (w < 0.0f ? 5 : 4);
"""
_CAPSULE = f"""
{_TUBE}
(void)tube_out;
const bool on_side = (inside > 0.0f) & (tube_in >= 0.0f) & (wp::abs(ez + tube_in * w) <= sy);
const float a3 = a + w * w, lower = ez + sy, upper = ez - sy;
const float b1 = b + w * lower, b2 = b + w * upper;
const float d1 = b1 * b1 - a3 * (c0 + lower * lower), d2 = b2 * b2 - a3 * (c0 + upper * upper);
const float t1 = (-b1 - sqrtf(d1 > 0.0f ? d1 : 0.0f)) / a3;
const float t2 = (-b2 - sqrtf(d2 > 0.0f ? d2 : 0.0f)) / a3;
const float side = on_side ? tube_in : 1e20f;
const float one = ((d1 > 0.0f) & (t1 >= 0.0f)) ? t1 : 1e20f;
const float two = ((d2 > 0.0f) & (t2 >= 0.0f)) ? t2 : 1e20f;
const float both = one < two ? one : two, along = side < both ? side : both;
const bool is_hit = along < 1e19f;
const int face = ROUND;
"""
_DRAW = """
for (int row = top / 8; row <= bottom / 8; ++row)
    for (int column = left / 8; column <= right / 8; ++column) {
        const int tile = row * canvas.across + column;
        if (least > canvas.farthest.data[tile]) continue;
        canvas.is_old.data[tile] = 1;
        float *const __restrict depths = canvas.depth.data + 64 * tile;
        int *const __restrict owners = canvas.owner.data + 64 * tile;
        int *const __restrict parts = canvas.part.data + 64 * tile;
        const float i0 = 8 * column - canvas.x0, j0 = 8 * row - canvas.y0;
#pragma clang loop vectorize(enable) interleave(disable)
        for (int k = 0; k < 64; ++k) {
            const float i = i0 + (k & 7), j = j0 + (k >> 3);
            const float u = ux + i * ui + j * uj, v = vx + i * vi + j * vj;
            const float w = wx + i * wi + j * wj;
            KIND
            const float before = depths[k];
            const float same = SAME * (before > 1.0f ? before : 1.0f);
            const float limit = number >= owners[k] ? before + same : before - same;
            const bool is_shown = is_hit & (along <= limit) & (along <= far);
            depths[k] = is_shown ? along : before;
            owners[k] = is_shown ? number : owners[k];
            parts[k] = is_shown ? face : parts[k];
        }
    }
"""


def of_each_kind(loop: str) -> str:
    """Return a loop over rays for each kind of solid, by the kind of `geom`.

    KIND becomes the test of a ray from (ex, ey, ez) along (u, v, w) in the frame of the geom, see
    `SOLID`, which says whether `is_hit`, how far `along`, and which `face`.
    """
    tests = {PLANE: _PLANE, BOX: _BOX, CYLINDER: _CYLINDER, CAPSULE: _CAPSULE}
    made = "".join(
        f"if (geom.kind == {int(kind)}) {{{loop.replace('KIND', test)}}} else "
        for kind, test in tests.items()
    )
    made += f"{{{loop.replace('KIND', _BALL)}}}"
    for name, value in (("SAME", f"{float(SAME)}f"), ("UPPER", int(UPPER)), ("ROUND", int(ROUND))):
        made = made.replace(name, str(value))
    return made


SOLID = f"""
const float sx = geom.size[0], sy = geom.size[1], sz = geom.size[2];
const bool is_sphere = geom.kind == {int(SPHERE)};
const bool is_ball = is_sphere || geom.kind == {int(ELLIPSOID)};
const float rx = is_ball ? 1.0f / sx : 1.0f;
const float ry = is_sphere ? rx : (is_ball ? 1.0f / sy : 1.0f);
const float rz = is_sphere ? rx : (is_ball ? 1.0f / sz : 1.0f);
"""
"""What all rays to a geom share: its size and the factors that make a ball of radius 1 of it, by
which places and directions in its frame are multiplied."""
START = f"""
const float c0 = is_ball ? ex * ex + ey * ey + ez * ez - 1.0f : ex * ex + ey * ey - sx * sx;
const float ends = wp::max(wp::abs(ez) - sy, 0.0f);
const bool is_inside = (geom.kind == {int(CAPSULE)}) & (c0 + ends * ends < 0.0f);
"""
"""What depends on where rays start alone; `is_inside` is for capsules, which then are not hit."""


@wp.func_native(f"""
{AXES.replace("ex =", "px =").replace("ey =", "py =").replace("ez =", "pz =")}
const int left = part[0], right = part[1], top = part[2], bottom = part[3];
const float far = canvas.far;
{SOLID}
const float ui = rx * (m[0][0] / x_scale), vi = ry * (m[1][0] / x_scale);
const float wi = rz * (m[2][0] / x_scale), uj = rx * (-m[0][1] / y_scale);
const float vj = ry * (-m[1][1] / y_scale), wj = rz * (-m[2][1] / y_scale);
const float ux = -m[0][2] * rx, vx = -m[1][2] * ry, wx = -m[2][2] * rz;
const float ex = px * rx, ey = py * ry, ez = pz * rz;
{START}
if (is_inside) return;
{of_each_kind(_DRAW)}
""")
def draw_solid(canvas: Canvas, geom: GeomView, number: int, part: wp.vec4i, least: float) -> None:
    """Draw a solid or plane, the rendered geom `number`, in the pixels of `part`; see `bounds`.

    `least` is its least depth.
    """
    ...


_NODE = """
    const float *const box = boxes + 6 * at;
    const float px = box[0] - ex, py = box[1] - ey, pz = box[2] - ez;
    const float hx = box[3], hy = box[4], hz = box[5];
    const float zc = z0 * px + z1 * py + z2 * pz;
    const float zh = wp::abs(z0) * hx + wp::abs(z1) * hy + wp::abs(z2) * hz;
    const float near = zc - zh;
    if (zc + zh < 0.0f || near > canvas.far) continue;
    int left = part[0], right = part[1], top = part[2], bottom = part[3];
    if (near > front) {
        const float xc = x0 * px + x1 * py + x2 * pz, yc = y0 * px + y1 * py + y2 * pz;
        const float xh = wp::abs(x0) * hx + wp::abs(x1) * hy + wp::abs(x2) * hz;
        const float yh = wp::abs(y0) * hx + wp::abs(y1) * hy + wp::abs(y2) * hz;
        const float per_near = 1.0f / near, per_far = 1.0f / (zc + zh);
        const float x_low = xc - xh, x_high = xc + xh, y_low = yc - yh, y_high = yc + yh;
        const float first = x_low * (x_low < 0.0f ? per_near : per_far) + canvas.x0 - slack;
        const float last = x_high * (x_high > 0.0f ? per_near : per_far) + canvas.x0 + slack;
        const float upper = y_low * (y_low < 0.0f ? per_near : per_far) + canvas.y0 - slack;
        const float lower = y_high * (y_high > 0.0f ? per_near : per_far) + canvas.y0 + slack;
        if (first > right || last < left || upper > bottom || lower < top) continue;
        left = first > left ? (int)ceilf(first) : left;
        right = last < right ? (int)floorf(last) : right;
        top = upper > top ? (int)ceilf(upper) : top;
        bottom = lower < bottom ? (int)floorf(lower) : bottom;
        if (left > right || top > bottom) continue;
    }
    const int columns = right / 8 - left / 8, rows = bottom / 8 - top / 8;
    bool is_hidden = false;
    if ((right - left + 1) * (bottom - top + 1) <= 8) {
        is_hidden = true;
        for (int y = top; y <= bottom && is_hidden; ++y)
            for (int x = left; x <= right; ++x) {
                const int tile = y / 8 * canvas.across + x / 8;
                is_hidden &= near > canvas.depth.data[64 * tile + y % 8 * 8 + x % 8];
            }
    } else if ((columns + 1) * (rows + 1) <= 16) {
        is_hidden = true;
        for (int tile = top / 8 * canvas.across + left / 8, i = 0; i <= rows && is_hidden; ++i)
            for (int j = 0; j <= columns && is_hidden; ++j) {
                const int here = tile + i * canvas.across + j;
                if (near <= canvas.farthest.data[here]) {
                    if (canvas.is_old.data[here]) {
                        const float *const depths = canvas.depth.data + 64 * here;
                        float most[8];
                        for (int c = 0; c < 8; ++c) most[c] = depths[c];
                        for (int r = 1; r < 8; ++r)
                            for (int c = 0; c < 8; ++c)
                                most[c] = most[c] > depths[8 * r + c] ? most[c] : depths[8 * r + c];
                        for (int c = 1; c < 8; ++c) most[0] = most[0] > most[c] ? most[0] : most[c];
                        canvas.farthest.data[here] = most[0] * 1.00001f;
                        canvas.is_old.data[here] = 0;
                    }
                    is_hidden = near > canvas.farthest.data[here];
                }
            }
    }
    if (is_hidden) continue;
"""
"""Skips node `at` unless one of the pixels from `left` to `right` and from `top` to `bottom` may
show a part of it."""

_LEAF = """
    const int slot = leaf + at - (leaves - 1);
    const float *const v = triangles.corners.data + 72 * slot;
    float ai[8], aj[8], a1[8], bi[8], bj[8], b1[8], ci[8], cj[8], c1[8];
    float lefts[8], rights[8], tops[8], bottoms[8], least[8];
#pragma clang loop vectorize(enable) interleave(disable)
    for (int k = 0; k < 8; ++k) {
        const float ax = v[k] - ex, ay = v[8 + k] - ey, az = v[16 + k] - ez;
        const float bx = v[24 + k] - ex, by = v[32 + k] - ey, bz = v[40 + k] - ez;
        const float cx = v[48 + k] - ex, cy = v[56 + k] - ey, cz = v[64 + k] - ez;
        const float aw = z0 * ax + z1 * ay + z2 * az, bw = z0 * bx + z1 * by + z2 * bz;
        const float au = x0 * ax + x1 * ay + x2 * az, bu = x0 * bx + x1 * by + x2 * bz;
        const float av = y0 * ax + y1 * ay + y2 * az, bv = y0 * bx + y1 * by + y2 * bz;
        const float cu = x0 * cx + x1 * cy + x2 * cz, cv = y0 * cx + y1 * cy + y2 * cz;
        const float cw = z0 * cx + z1 * cy + z2 * cz;
        ai[k] = au, aj[k] = av, a1[k] = aw, bi[k] = bu, bj[k] = bv, b1[k] = bw;
        ci[k] = cu, cj[k] = cv, c1[k] = cw;
        const float ab = aw < bw ? aw : bw, near = ab < cw ? ab : cw;
        const float a_per = 1.0f / aw, b_per = 1.0f / bw, c_per = 1.0f / cw;
        const float as = au * a_per, bs = bu * b_per, cs = cu * c_per;
        const float at = av * a_per, bt = bv * b_per, ct = cv * c_per;
        const float ab_left = as < bs ? as : bs, ab_right = as < bs ? bs : as;
        const float most = ab_right > cs ? ab_right : cs;
        const float ab_top = at < bt ? at : bt, ab_bottom = at < bt ? bt : at;
        const float area = (bs - as) * (ct - at) - (bt - at) * (cs - as);
        const bool is_cut = near <= front, is_back = !is_cut & (area > 1e-3f);
        lefts[k] = is_cut ? -1e9f : (ab_left < cs ? ab_left : cs) + canvas.x0 - slack;
        rights[k] = is_back ? -1e9f : (is_cut ? 1e9f : most + canvas.x0 + slack);
        tops[k] = is_cut ? -1e9f : (ab_top < ct ? ab_top : ct) + canvas.y0 - slack;
        bottoms[k] = is_cut ? 1e9f : (ab_bottom > ct ? ab_bottom : ct) + canvas.y0 + slack;
        least[k] = near;
    }
    for (int k = 0; k < 8; ++k) {
        const int from = lefts[k] > left ? (int)ceilf(wp::min(lefts[k], 1e6f)) : left;
        const int to = rights[k] < right ? (int)floorf(wp::max(rights[k], -1e6f)) : right;
        const int begin = tops[k] > top ? (int)ceilf(wp::min(tops[k], 1e6f)) : top;
        const int end = bottoms[k] < bottom ? (int)floorf(wp::max(bottoms[k], -1e6f)) : bottom;
        if (from > to || begin > end) continue;
        const float pi = ci[k] - bi[k], pj = cj[k] - bj[k], p1 = c1[k] - b1[k];
        const float qi = ai[k] - ci[k], qj = aj[k] - cj[k], q1 = a1[k] - c1[k];
        const float ri = bi[k] - ai[k], rj = bj[k] - aj[k], r1 = b1[k] - a1[k];
        const float ni = qj * r1 - q1 * rj, nj = q1 * ri - qi * r1, n1 = qi * rj - qj * ri;
        const float height = ai[k] * ni + aj[k] * nj + a1[k] * n1;
        if (!(height < 0.0f)) continue;
        const float si = ci[k] + bi[k], sj = cj[k] + bj[k], s1 = c1[k] + b1[k];
        const float ti = ai[k] + ci[k], tj = aj[k] + cj[k], t1 = a1[k] + c1[k];
        const float mi = bi[k] + ai[k], mj = bj[k] + aj[k], m1 = b1[k] + a1[k];
        const float ui = pj * s1 - p1 * sj, uj = p1 * si - pi * s1, u1 = pi * sj - pj * si;
        const float vi = qj * t1 - q1 * tj, vj = q1 * ti - qi * t1, v1 = qi * tj - qj * ti;
        const float wi = rj * m1 - r1 * mj, wj = r1 * mi - ri * m1, w1 = ri * mj - rj * mi;
        const int triangle = 8 * slot + k;
        for (int row = begin / 8; row <= end / 8; ++row)
            for (int column = from / 8; column <= to / 8; ++column) {
                const int tile = row * canvas.across + column;
                if (least[k] > canvas.farthest.data[tile]) continue;
                const int first_row = begin > 8 * row ? begin - 8 * row : 0;
                const int last_row = end < 8 * row + 7 ? end - 8 * row : 7;
                const float i0 = 8 * column - canvas.x0;
                canvas.is_old.data[tile] = 1;
                for (int y = first_row; y <= last_row; ++y) {
                    const float j = 8 * row + y - canvas.y0;
                    const float u0 = u1 + j * uj, v0 = v1 + j * vj;
                    const float w0 = w1 + j * wj, n0 = n1 + j * nj;
                    float *const __restrict depths = canvas.depth.data + 64 * tile + 8 * y;
                    int *const __restrict owners = canvas.owner.data + 64 * tile + 8 * y;
                    int *const __restrict parts = canvas.part.data + 64 * tile + 8 * y;
                    float shown[8];
#pragma clang loop vectorize(enable) interleave(disable)
                    for (int c = 0; c < 8; ++c) {
                        const float i = i0 + c;
                        const float u = u0 + i * ui, v = v0 + i * vi, w = w0 + i * wi;
                        const float along = height / (n0 + i * ni);
                        const float before = depths[c];
                        const float same = SAME * (before > 1.0f ? before : 1.0f);
                        const float limit = number >= owners[c] ? before + same : before - same;
                        const bool is_in = (u >= 0.0f) & (v >= 0.0f) & (w >= 0.0f);
                        const bool is_near = (along > 0.0f) & (along <= limit) & (along <= far);
                        shown[c] = (is_in & is_near) ? along : -1.0f;
                    }
                    bool is_shown = false;
                    for (int c = 0; c < 8; ++c) is_shown |= shown[c] > 0.0f;
                    if (!is_shown) continue;
                    for (int c = 0; c < 8; ++c) {
                        const bool is_here = shown[c] > 0.0f;
                        depths[c] = is_here ? shown[c] : depths[c];
                        owners[c] = is_here ? number : owners[c];
                        parts[c] = is_here ? triangle : parts[c];
                    }
                }
            }
    }
    continue;
""".replace("SAME", f"{float(SAME)}f")


@wp.func_native(f"""
{AXES}
const float x0 = x_scale * m[0][0], x1 = x_scale * m[1][0], x2 = x_scale * m[2][0];
const float y0 = -y_scale * m[0][1], y1 = -y_scale * m[1][1], y2 = -y_scale * m[2][1];
const float z0 = -m[0][2], z1 = -m[1][2], z2 = -m[2][2];
const float far = canvas.far, front = {float(NEAR)}f, slack = 0.002f;
const int root = triangles.node.data[mesh], leaf = triangles.leaf.data[mesh];
const int leaves = 1 << triangles.depth.data[mesh];
const float *const boxes = triangles.boxes.data + 6 * root;
int stack[64], depth = 1;
stack[0] = 0;
while (depth > 0) {{
    const int at = stack[--depth];
    {_NODE}
    if (at >= leaves - 1) {{
        {_LEAF}
    }}
    const int one = 2 * at + 1, other = 2 * at + 2;
    const float *const a = boxes + 6 * one, *const b = boxes + 6 * other;
    const float apart = z0 * (b[0] - a[0]) + z1 * (b[1] - a[1]) + z2 * (b[2] - a[2]);
    stack[depth++] = apart > 0.0f ? other : one;
    stack[depth++] = apart > 0.0f ? one : other;
}}""")
def draw_mesh(
    canvas: Canvas, triangles: Triangles, mesh: int, geom: GeomView, number: int, part: wp.vec4i
) -> None:
    """Draw the fronts of a mesh's triangles; see `draw_solid`."""
    ...
