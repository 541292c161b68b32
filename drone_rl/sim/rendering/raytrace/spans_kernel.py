"""Vectorized loops in C++ over spans of contiguous pixels; fog and textures are applied here.

Warp's own loops allow for strided arrays and are not vectorized. A GPU calls these functions for
one pixel. Each processes the pixels from `first` up to, not including, `last`.
"""

from typing import Any

import warp as wp

from drone_rl.sim.rendering.raytrace.structs_kernel import Job, SurfaceLight, TextureMap


@wp.func_native("for (int i = first; i < last; ++i) values.data[i] = value;")
def fill(values: wp.array[Any], first: int, last: int, value: Any) -> None:
    """Write one value."""


@wp.func_native("for (int i = first; i < last; ++i) values.data[i] = given.data[i];")
def copy(values: wp.array[Any], first: int, last: int, given: wp.array[Any]) -> None:
    """Copy values."""


@wp.func_native("for (int i = first; i < last; ++i) values.data[i] = given.data[i] * by.data[i];")
def multiply(
    values: wp.array[float], first: int, last: int, given: wp.array[float], by: wp.array[float]
) -> None:
    """Write the products of two arrays."""


@wp.func_native("""
for (int i = first; i < last; ++i) {
    const wp::vec_t<3, float> ray = rays.data[i];
    const float along = height / (down[0] * ray[0] + down[1] * ray[1] + down[2] * ray[2]);
    const float so_far = nearest.data[i];
    const bool is_nearer = along - so_far <= same * (so_far > 1.0f ? so_far : 1.0f);
    nearest.data[i] = is_nearer ? along : so_far;
    owner.data[i] = is_nearer ? mark : owner.data[i];
}""")
def intersect_level_plane(
    nearest: wp.array[float],
    owner: wp.array[int],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    down: wp.vec3,
    height: float,
    same: float,
    mark: int,
) -> None:
    """Intersect rays with a plane that all of them meet; `mark` the pixels in which it is nearest.

    `down` is the plane's normal in the camera's frame, and `height` the eye's height above the
    plane, negated: only their quotient counts. `same` is the relative distance within which the
    plane is in front of what was nearest.
    """


@wp.func_native("""
#pragma clang fp contract(off)
for (int i = first; i < last; ++i) {
    const wp::vec_t<3, unsigned char> color = colors.data[i];
    const float two = (float)((double)((float)color[0] * red) + (double)color[1] * (double)green);
    gray.data[i] = (float)((double)two + (double)((float)color[2] * blue));
}""")
def mix_gray(
    gray: wp.array[float],
    first: int,
    last: int,
    colors: wp.array[wp.vec3ub],
    red: float,
    green: float,
    blue: float,
) -> None:
    """Write gray of colors by weights; each sum is rounded as by torch on x86."""


@wp.func_native("""
for (int i = first; i < last; ++i) {
    const wp::vec_t<3, float> ray = job.rays.data[i];
    const float height = up[0] * ray[0] + up[1] * ray[1] + up[2] * ray[2];
    const float share = height > 0.0f ? height : 0.0f;
    for (int c = 0; c < 3; ++c)
        job.colors.data[i][c] = (unsigned char)(int)(horizon[c] + share * (zenith[c] - horizon[c]));
}""")
def shade_sky(
    job: Job, first: int, last: int, up: wp.vec3, horizon: wp.vec3, zenith: wp.vec3
) -> None:
    """Color the sky; `up` is the world's up axis in the camera's frame."""


_FADE = """
    const float power = wp::max(-1.44269504f * extinction * far[i], -120.0f);
    const int whole = (int)(power - 0.5f);
    const float part = power - (float)whole;
    union { int bits; float number; } two;
    two.bits = (whole + 127) << 23;
    const float clear = two.number * (1.0f + part * (0.69314718f + part * (0.24022651f + part
        * (0.05550411f + part * (0.00961813f + part * 0.00133336f)))));
"""
"""Fog: the fraction `clear` of a color that passes, e^(-extinction distance), by a polynomial."""
_READ = """
const float *const far = job.nearest.data;
const int *const dark = job.dark.data;
wp::vec_t<3, unsigned char> *const colors = job.colors.data;
const wp::vec_t<3, float> lit = light.lit, shaded = light.shaded, horizon = light.horizon;
const float extinction = light.extinction;
"""
"""Loads everything before the first write, which C++ must assume to alias."""
_WRITE = """
    for (int c = 0; c < 3; ++c) {
        const float full = color[c] < 255.0f ? color[c] : 255.0f;
        colors[i][c] = (unsigned char)(int)(clear * full + (1.0f - clear) * horizon[c]);
    }
"""


@wp.func_native(f"""
{_READ}
for (int i = first; i < last; ++i) {{
    {_FADE}
    const float in_sun = dark[i] ? 0.0f : 1.0f;
    const float color[3] = {{
        shaded[0] + in_sun * (lit[0] - shaded[0]),
        shaded[1] + in_sun * (lit[1] - shaded[1]),
        shaded[2] + in_sun * (lit[2] - shaded[2])}};
    {_WRITE}
}}""")
def shade_plain(job: Job, first: int, last: int, light: SurfaceLight) -> None:
    """Color a flat face, with shadow and fog."""


_AT_ONCE = """
#ifdef __CUDA_ARCH__
const int at_once = 1;
#else
const int at_once = 64;
#endif
"""
"""Pixels of a block: separating the reads of texels from the arithmetic makes both faster."""


@wp.func_native(f"""
{_READ}
{_AT_ONCE}
const float x_on = texture.across[0], y_on = texture.across[1], z_on = texture.across[2];
const float x_down = texture.down[0], y_down = texture.down[1], z_down = texture.down[2];
const float x_against = texture.facing[0], y_against = texture.facing[1];
const float z_against = texture.facing[2];
const float corner_x = texture.corner[0], corner_y = texture.corner[1], area = texture.area;
const int begin = texture.start, whole_side = texture.side;
const unsigned *const stored = texels.data;
const wp::vec_t<3, float> *const seen = job.rays.data;
int of_a[at_once], of_b[at_once], of_c[at_once], of_d[at_once];
int lower[at_once], right[at_once];
unsigned a[at_once], b[at_once], c[at_once], d[at_once];
for (int from = first; from < last; from += at_once) {{
const int count = last - from < at_once ? last - from : at_once;
for (int k = 0; k < count; ++k) {{
    const float x = seen[from + k][0], y = seen[from + k][1], z = seen[from + k][2];
    const float along = far[from + k];
    const float facing = x_against * x + y_against * y + z_against * z;
    union {{ int bits; float number; }} covered;
    covered.number = -area * along * along * z * z * z / (facing > 1e-3f ? facing : 1e-3f);
    int level = ((covered.bits >> 23) - 126) >> 1;
    level = level < 0 ? 0 : level;
    const int finer = whole_side >> (level < 31 ? level : 31);
    const int side = finer > 1 ? finer : 1, mask = side - 1;
    const int start = begin + (whole_side * whole_side - side * side) / 3 * 4;
    const float across = (corner_x + along * (x_on * x + y_on * y + z_on * z)) * side - 0.5f;
    const float down = (corner_y + along * (x_down * x + y_down * y + z_down * z)) * side - 0.5f;
    const int column = (int)across - (across < (float)(int)across);
    const int row = (int)down - (down < (float)(int)down);
    const int share_right = (int)((across - column) * 256.0f);
    const int share_lower = (int)((down - row) * 256.0f);
    right[k] = share_right < 255 ? share_right : 255;
    lower[k] = share_lower < 255 ? share_lower : 255;
    const int above = start + (row & mask) * side, below = start + ((row + 1) & mask) * side;
    of_a[k] = above + (column & mask);
    of_b[k] = above + ((column + 1) & mask);
    of_c[k] = below + (column & mask);
    of_d[k] = below + ((column + 1) & mask);
}}
#pragma clang loop vectorize(disable)
for (int k = 0; k < count; ++k) {{
    a[k] = stored[of_a[k]];
    b[k] = stored[of_b[k]];
    c[k] = stored[of_c[k]];
    d[k] = stored[of_d[k]];
}}
for (int k = 0; k < count; ++k) {{
    const int i = from + k;
    {_FADE}
    const unsigned share_d = (right[k] * lower[k]) >> 8;
    const unsigned share_b = right[k] - share_d, share_c = lower[k] - share_d;
    const unsigned share_a = 256u - right[k] - share_c;
    const unsigned red_and_blue = share_a * (a[k] & 0xff00ffu) + share_b * (b[k] & 0xff00ffu)
        + share_c * (c[k] & 0xff00ffu) + share_d * (d[k] & 0xff00ffu);
    const unsigned green = share_a * ((a[k] >> 8) & 255u) + share_b * ((b[k] >> 8) & 255u)
        + share_c * ((c[k] >> 8) & 255u) + share_d * ((d[k] >> 8) & 255u);
    const float in_sun = dark[i] ? 0.0f : 1.0f, unit = 1.0f / 65280.0f;
    const float color[3] = {{
        (shaded[0] + in_sun * (lit[0] - shaded[0])) * unit * (int)(red_and_blue & 0xffffu),
        (shaded[1] + in_sun * (lit[1] - shaded[1])) * unit * (int)green,
        (shaded[2] + in_sun * (lit[2] - shaded[2])) * unit * (int)(red_and_blue >> 16)}};
    {_WRITE}
}}
}}""")
def shade_textured(
    job: Job,
    first: int,
    last: int,
    light: SurfaceLight,
    texture: TextureMap,
    texels: wp.array[wp.uint32],
) -> None:
    """Color a textured face; `light` has the colors of a white texel.

    Texels are interpolated bilinearly. The mip level follows from the number of texels that a pixel
    covers: half its base-2 logarithm, rounded.
    """
