"""What is done alike to pixels that follow each other, in C++: many of them at a time.

Warp lets an array have gaps and reads a pixel's place anew each time, so that its own loops take
pixels one by one. These arrays have none.
"""

import warp as wp

_FILL = "for (int i = first; i < last; ++i) values.data[i] = value;"


@wp.func_native(_FILL)
def fill_floats(values: wp.array[float], first: int, last: int, value: float) -> None:
    """Writes one number into pixels from the first to the one before the last."""
    ...


@wp.func_native(_FILL)
def fill_ints(values: wp.array[int], first: int, last: int, value: int) -> None:
    """The same of whole numbers."""
    ...


@wp.func_native(_FILL)
def fill_bytes(values: wp.array[wp.vec3ub], first: int, last: int, value: wp.vec3ub) -> None:
    """The same of colours."""
    ...


@wp.func_native("""
const float x = value[0], y = value[1], z = value[2];
float *const at = (float *)values.data;
for (int i = first; i < last; ++i) {
    at[3 * i] = x;
    at[3 * i + 1] = y;
    at[3 * i + 2] = z;
}""")
def fill_vectors(values: wp.array[wp.vec3], first: int, last: int, value: wp.vec3) -> None:
    """The same of vectors."""
    ...


@wp.func_native("for (int i = first; i < last; ++i) values.data[i] = given.data[i];")
def copy(values: wp.array[float], first: int, last: int, given: wp.array[float]) -> None:
    """Writes the numbers of others."""
    ...


@wp.func_native("for (int i = first; i < last; ++i) values.data[i] = given.data[i] * by.data[i];")
def multiply(
    values: wp.array[float], first: int, last: int, given: wp.array[float], by: wp.array[float]
) -> None:
    """Writes the products of others."""
    ...


@wp.func_native("""
for (int i = first; i < last; ++i) {
    const wp::vec_t<3, float> ray = rays.data[i];
    const float along = height / (down[0] * ray[0] + down[1] * ray[1] + down[2] * ray[2]);
    const float so_far = nearest.data[i];
    const bool is_nearer = along - so_far <= same * (so_far > 1.0f ? so_far : 1.0f);
    nearest.data[i] = is_nearer ? along : so_far;
    owner.data[i] = is_nearer ? mark : owner.data[i];
}""")
def meet_level(
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
    """Marks the pixels in which a plane, which all of them meet, is the nearest.

    Args:
        nearest: How far away the nearest was before.
        owner: Whose it is.
        first: The first pixel.
        last: The one after the last.
        rays: Of the pixels.
        down: What a ray is multiplied by to find how fast it comes nearer to the plane.
        height: Of the eye over the plane.
        same: Relative distance within which the plane is in front.
        mark: For the owner.
    """
    ...


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
    """Gray of colours by weights, each sum rounded as by torch on x86."""
    ...


@wp.func_native("for (int i = first; i < last; ++i) values.data[i] = given.data[i];")
def copy_colors(
    values: wp.array[wp.vec3ub], first: int, last: int, given: wp.array[wp.vec3ub]
) -> None:
    """Writes the colours of others."""
    ...
