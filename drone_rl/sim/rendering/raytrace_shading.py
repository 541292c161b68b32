# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""Colours of pixels that follow each other where these are not all the same, in C++.

See `raytrace_rows` for why. A GPU calls the same for one pixel at a time.
"""

import warp as wp


@wp.struct
class Cover:
    """A texture as it lies on a face, for one camera."""

    start: int
    """The first texel; `levels` says what follows."""
    side: int
    """Texels each way: a power of 2."""
    across: wp.vec3
    """What the way along a ray is multiplied by to go across the texture, in tiles."""
    down: wp.vec3
    corner: wp.vec2
    """Where the camera is, across and down."""
    facing: wp.vec3
    """Against the face, in the camera's frame."""
    area: float
    """Texels, of the finest, that a pixel at the middle of the picture covers in 1 m."""


@wp.func_native("""
for (int i = first; i < last; ++i) {
    const wp::vec_t<3, float> ray = rays.data[i];
    const float height = up[0] * ray[0] + up[1] * ray[1] + up[2] * ray[2];
    const float share = height > 0.0f ? height : 0.0f;
    for (int c = 0; c < 3; ++c)
        colors.data[i][c] = (unsigned char)(int)(horizon[c] + share * (zenith[c] - horizon[c]));
}""")
def shade_sky(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    up: wp.vec3,
    horizon: wp.vec3,
    zenith: wp.vec3,
) -> None:
    """Colours the sky.

    Args:
        colors: Are written.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        up: What a ray is multiplied by to find the sine of its elevation.
        horizon: Colour of the sky there and below, from 0 to 255.
        zenith: The same overhead.
    """
    ...


_FADE = """
    const float power = wp::max(-1.44269504f * fog * nearest.data[i], -120.0f);
    const int whole = (int)(power - 0.5f);
    const float part = power - (float)whole;
    union { int bits; float number; } two;
    two.bits = (whole + 127) << 23;
    const float clear = two.number * (1.0f + part * (0.69314718f + part * (0.24022651f + part
        * (0.05550411f + part * (0.00961813f + part * 0.00133336f)))));
"""
"""The share of a colour that fog leaves over."""
_WRITE = """
    for (int c = 0; c < 3; ++c) {
        const float full = color[c] < 255.0f ? color[c] : 255.0f;
        colors.data[i][c] = (unsigned char)(int)(clear * full + (1.0f - clear) * horizon[c]);
    }
"""


@wp.func_native(f"""
for (int i = first; i < last; ++i) {{
    {_FADE}
    const float in_sun = dark.data[i] ? 0.0f : 1.0f;
    const float color[3] = {{
        shaded[0] + in_sun * (lit[0] - shaded[0]),
        shaded[1] + in_sun * (lit[1] - shaded[1]),
        shaded[2] + in_sun * (lit[2] - shaded[2])}};
    {_WRITE}
}}""")
def shade_even(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    nearest: wp.array[float],
    dark: wp.array[int],
    lit: wp.vec3,
    shaded: wp.vec3,
    fog: float,
    horizon: wp.vec3,
) -> None:
    """Colours a flat face.

    Args:
        colors: Are written.
        first: The first pixel.
        last: The one after the last.
        nearest: How far along its ray it is.
        dark: Whether it is in shadow there.
        lit: Its colour in the sun, from 0 to 255 or more.
        shaded: The same in shadow.
        fog: See `Scenery.fog`.
        horizon: Colour of the fog.
    """
    ...


@wp.func_native(f"""
const wp::vec_t<3, float> right_on = cover.across, down_on = cover.down, against = cover.facing;
const float corner_x = cover.corner[0], corner_y = cover.corner[1], area = cover.area;
const int begin = cover.start, whole_side = cover.side;
const unsigned *const stored = texels.data;
for (int i = first; i < last; ++i) {{
    {_FADE}
    const wp::vec_t<3, float> ray = rays.data[i];
    const float along = nearest.data[i], cosine = -ray[2];
    const float facing = wp::dot(against, ray);
    union {{ int bits; float number; }} covered;
    covered.number = area * along * along * cosine * cosine * cosine
        / (facing > 1e-3f ? facing : 1e-3f);
    int level = ((covered.bits >> 23) - 126) >> 1;
    level = level < 0 ? 0 : level;
    const int finer = whole_side >> (level < 31 ? level : 31);
    const int side = finer > 1 ? finer : 1, mask = side - 1;
    const int start = begin + (whole_side * whole_side - side * side) / 3 * 4;
    const float across = (corner_x + along * wp::dot(right_on, ray)) * side - 0.5f;
    const float down = (corner_y + along * wp::dot(down_on, ray)) * side - 0.5f;
    const int column = (int)across - (across < (float)(int)across);
    const int row = (int)down - (down < (float)(int)down);
    const unsigned right = wp::min((int)((across - column) * 256.0f), 255);
    const unsigned lower = wp::min((int)((down - row) * 256.0f), 255);
    const int above = start + (row & mask) * side, below = start + ((row + 1) & mask) * side;
    const unsigned a = stored[above + (column & mask)];
    const unsigned b = stored[above + ((column + 1) & mask)];
    const unsigned c = stored[below + (column & mask)];
    const unsigned d = stored[below + ((column + 1) & mask)];
    const unsigned of_d = (right * lower) >> 8, of_b = right - of_d, of_c = lower - of_d;
    const unsigned of_a = 256u - right - of_c;
    const unsigned red_and_blue = of_a * (a & 0xff00ffu) + of_b * (b & 0xff00ffu)
        + of_c * (c & 0xff00ffu) + of_d * (d & 0xff00ffu);
    const unsigned green = of_a * ((a >> 8) & 255u) + of_b * ((b >> 8) & 255u)
        + of_c * ((c >> 8) & 255u) + of_d * ((d >> 8) & 255u);
    const float in_sun = dark.data[i] ? 0.0f : 1.0f, unit = 1.0f / 65280.0f;
    const float color[3] = {{
        (shaded[0] + in_sun * (lit[0] - shaded[0])) * unit * (int)(red_and_blue & 0xffffu),
        (shaded[1] + in_sun * (lit[1] - shaded[1])) * unit * (int)green,
        (shaded[2] + in_sun * (lit[2] - shaded[2])) * unit * (int)(red_and_blue >> 16)}};
    {_WRITE}
}}""")
def shade_covered(
    colors: wp.array[wp.vec3ub],
    first: int,
    last: int,
    rays: wp.array[wp.vec3],
    nearest: wp.array[float],
    dark: wp.array[int],
    texels: wp.array[wp.uint32],
    cover: Cover,
    lit: wp.vec3,
    shaded: wp.vec3,
    fog: float,
    horizon: wp.vec3,
) -> None:
    """The same of a face with a texture, which is multiplied by its colour.

    Of the four texels around a place each has a share; how much a pixel covers, in the mean of its
    two sides, chooses the level.

    Args:
        colors: See `shade_even`, as what is not told here.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        nearest: How far along its ray it is.
        dark: Whether it is in shadow there.
        texels: Of all textures, see `Scenery`.
        cover: The texture on this face.
        lit: In the sun, of what is white in the texture.
        shaded: The same in shadow.
        fog: See `Scenery.fog`.
        horizon: Colour of the fog.
    """
    ...
