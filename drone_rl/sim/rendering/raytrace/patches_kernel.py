"""Colors of all pixels of a tile that show one `Patch`, over which they change evenly."""

import warp as wp

from drone_rl.sim.rendering.raytrace.canvas_kernel import AXES, Canvas
from drone_rl.sim.rendering.raytrace.cast_kernel import MESH
from drone_rl.sim.rendering.raytrace.corners_kernel import SMALL
from drone_rl.sim.rendering.raytrace.light_kernel import Shot
from drone_rl.sim.rendering.raytrace.shade_kernel import Surface
from drone_rl.sim.rendering.raytrace.structs_kernel import GeomView, struct
from drone_rl.sim.rendering.raytrace.texels_kernel import SAMPLE

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@struct
class Block:
    """Pixels of a tile, while they are shaded."""

    colors: wp.array[wp.vec3]
    """0 to 1."""
    is_shown: wp.array[int]
    """Whether a pixel has its color."""
    pixels: wp.array[wp.vec3ub]
    """The whole image, row by row."""


_EVEN = """
struct Even {
    float from, axis, right, down;
    float along(float i, float j) const { return axis + i * right + j * down; }
};
const auto even = [&](const wp::vec_t<3, float> &f, float start) {
    return Even{
        start + f[0] * ex + f[1] * ey + f[2] * ez,
        -(f[0] * m[0][2] + f[1] * m[1][2] + f[2] * m[2][2]),
        (f[0] * m[0][0] + f[1] * m[1][0] + f[2] * m[2][0]) / x_scale,
        -(f[0] * m[0][1] + f[1] * m[1][1] + f[2] * m[2][1]) / y_scale};
};
"""
"""Makes f @ p + start, for a place p in the geom's frame, a function of pixel and depth."""


@wp.func_native(
    f"""
{AXES}
{_EVEN}
const auto &surface = faces.data[0];
const auto &patch = surface.patch;
const auto &mapping = surface.mapping;
const float i0 = tile % canvas.across * 8 - canvas.x0, j0 = tile / canvas.across * 8 - canvas.y0;
const float *const __restrict depths = canvas.depth.data + 64 * tile;
const int *const __restrict owners = canvas.owner.data + 64 * tile;
const int *const __restrict parts = canvas.part.data + 64 * tile;
const int owner = owners[first], part = parts[first];
const Even x = even(patch.across, patch.shift[0]), y = even(patch.up, patch.shift[1]);
const float cut_x = patch.cut[0], cut_y = patch.cut[1], cut = patch.cut[2];
const float far = patch.edge / ({float(SMALL)}f * shot.pixel);
const float low = surface.face.kind == MESH ? -1e30f : 0.0f, high = 1.0f - low;
float slopes[18], light[3][64];
int is_in[64];
for (int k = 0; k < 18; ++k) slopes[k] = shot.slopes.data[k / 3][k % 3];
#pragma clang loop vectorize(enable) interleave(disable)
for (int k = 0; k < 64; ++k) {{
    const float i = i0 + (k & 7), j = j0 + (k >> 3), depth = depths[k];
    const float u = x.from + depth * x.along(i, j), v = y.from + depth * y.along(i, j);
    const bool is_here = (owners[k] == owner) & (parts[k] == part) & (block.is_shown.data[k] == 0);
    const bool is_on = (u >= low) & (u <= high) & (v >= low) & (v <= high) & (depth <= far);
    is_in[k] = is_here & (is_on | (k == first));
    const bool is_second = cut_x * u + cut_y * v + cut > 0.0f;
    for (int c = 0; c < 3; ++c) {{
        const float one = slopes[c] + u * slopes[3 + c] + v * slopes[6 + c];
        const float two = slopes[9 + c] + u * slopes[12 + c] + v * slopes[15 + c];
        light[c][k] = is_second ? two : one;
    }}
}}
if (mapping.texture >= 0) {{
    const Even s = even(mapping.across, mapping.start[0]), t = even(mapping.down, mapping.start[1]);
    const Even n = even(surface.face.normal, 0.0f);
    const auto &image = surface.image;
    const float wide = image.width, tall = image.height;
    const int face = 0;
    float place_s[64], place_t[64], size[64];
#pragma clang loop vectorize(enable) interleave(disable)
    for (int k = 0; k < 64; ++k) {{
        const float i = i0 + (k & 7), j = j0 + (k >> 3), depth = depths[k];
        const float along_s = s.along(i, j), along_t = t.along(i, j);
        const float per = 1.0f / n.along(i, j), right = per * n.right, down = per * n.down;
        const float s1 = wide * (s.right - right * along_s), s2 = wide * (s.down - down * along_s);
        const float t1 = tall * (t.right - right * along_t), t2 = tall * (t.down - down * along_t);
        const float one = s1 * s1 + t1 * t1, two = s2 * s2 + t2 * t2;
        size[k] = depth * sqrtf(one > two ? one : two);
        const float at_s = s.from + depth * along_s, at_t = t.from + depth * along_t;
        place_s[k] = at_s - floorf(at_s);
        place_t[k] = at_t - floorf(at_t);
    }}
    for (int k = 0; k < 64; ++k) {{
        if (!is_in[k]) continue;
        const float across = place_s[k], down = place_t[k];
        float covered = size[k];
        {SAMPLE}
        for (int c = 0; c < 3; ++c) light[c][k] *= total[c];
    }}
}}
const float thin = shot.extinction;
for (int k = 0; k < 64; ++k) {{
    if (!is_in[k]) continue;
    float hidden = 0.0f;
    if (thin > 0.0f) {{
        const float i = (i0 + (k & 7)) / x_scale, j = (j0 + (k >> 3)) / y_scale;
        hidden = 1.0f - expf(-thin * depths[k] * sqrtf(1.0f + i * i + j * j));
    }}
    for (int c = 0; c < 3; ++c) {{
        const float lit = shot.exposure * light[c][k];
        const float most = lit < 1.0f ? lit : 1.0f, color = most > 0.0f ? most : 0.0f;
        block.colors.data[k][c] = color + hidden * (shot.haze[c] - color);
    }}
    block.is_shown.data[k] = 1;
}}
""".replace("MESH", str(int(MESH)))
)
def shade_patch(
    canvas: Canvas,
    tile: int,
    first: int,
    geom: GeomView,
    faces: wp.array[Surface],
    shot: Shot,
    texels: wp.array[wp.uint32],
    block: Block,
) -> None:
    """Write the colors, 0 to 1, of the pixels of a tile on the patch that pixel `first` shows.

    `faces[0].patch` must be lit; no light casts shadows. Pixels with `Block.is_shown` are left out;
    it is set for those that are written.
    """
    ...
