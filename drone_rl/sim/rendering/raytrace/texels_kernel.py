"""Textures with mip levels, flat ones and cube maps, sampled as OpenGL does."""

import warp as wp

from drone_rl.sim.rendering.raytrace.structs_kernel import struct

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@struct
class Textures:
    """Textures one after the other, each with its mip levels, the finest first."""

    width: wp.array[int]
    height: wp.array[int]
    faces: wp.array[int]
    """Images of each level: 6 of a cube map, 1 of a flat texture."""
    start: wp.array[int]
    """First texel of each texture."""
    texels: wp.array[wp.uint32]
    """Red in the lowest 8 bits, then green, then blue."""


@struct
class Image:
    """One texture; see `Textures`."""

    width: int
    height: int
    faces: int
    start: int


@wp.func
def get_image(textures: Textures, texture: int) -> Image:
    """Return a texture."""
    image = Image()
    image.width = textures.width[texture]
    image.height = textures.height[texture]
    image.faces = textures.faces[texture]
    image.start = textures.start[texture]
    return image


@wp.func
def sample_flat(
    texels: wp.array[wp.uint32], image: Image, here: wp.vec3, right: wp.vec3, below: wp.vec3
) -> wp.vec3:
    """Return the color, 0 to 1, at coordinates in a texture that repeats.

    `right` and `below` are the steps to the coordinates of the next pixels.
    """
    width, height = float(image.width), float(image.height)
    one = wp.vec2(right[0] * width, right[1] * height)
    two = wp.vec2(below[0] * width, below[1] * height)
    most = wp.sqrt(wp.max(wp.length_sq(one), wp.length_sq(two)))
    across, down = here[0] - wp.floor(here[0]), here[1] - wp.floor(here[1])
    return sample_levels(texels, image, 0, across, down, most)


@wp.func
def sample_cube(
    texels: wp.array[wp.uint32], image: Image, ray: wp.vec3, right: wp.vec3, below: wp.vec3
) -> wp.vec3:
    """Return the color, 0 to 1, of a cube map in a direction.

    `right` and `below` are the steps to the directions of the next pixels.
    """
    axis = int(wp.argmax(wp.vec3(wp.abs(ray[0]), wp.abs(ray[1]), wp.abs(ray[2]))))
    face = 2 * axis
    if ray[axis] < 0.0:
        face += 1
    here = _on_face(face, axis, ray)
    one, two = _on_face(face, axis, ray + right) - here, _on_face(face, axis, ray + below) - here
    most = wp.sqrt(wp.max(wp.length_sq(one), wp.length_sq(two)))
    return sample_levels(texels, image, face, here[0], here[1], most * float(image.width))


@wp.func
def _on_face(face: int, axis: int, ray: wp.vec3) -> wp.vec2:
    """Return coordinates on a face of a cube map (OpenGL 4.6, table 8.19)."""
    across, down = ray[0], -ray[1]
    if face == 0:
        across = -ray[2]
    if face == 1:
        across = ray[2]
    if face == 2:
        down = ray[2]
    if face == 3:
        down = -ray[2]
    if face == 5:
        across = -ray[0]
    half = 0.5 / wp.max(wp.abs(ray[axis]), 1e-9)
    return wp.vec2(0.5 + half * across, 0.5 + half * down)


SAMPLE = """
typedef float floats __attribute__((ext_vector_type(4)));
typedef unsigned char bytes __attribute__((ext_vector_type(4)));
int width = image.width, height = image.height, start = image.start;
const bool is_cube = image.faces > 1;
while (covered >= 2.0f && (width > 1 || height > 1)) {
    start += width * height * image.faces;
    width = width > 1 ? width / 2 : 1;
    height = height > 1 ? height / 2 : 1;
    covered *= 0.5f;
}
floats total = 0.0f;
float share = 1.0f;
const bool has_next = covered > 1.0f && (width > 1 || height > 1);
for (int level = 0; level < 1 + has_next; ++level) {
    const float x = across * width - 0.5f, y = down * height - 0.5f;
    const int i = (int)floorf(x), j = (int)floorf(y);
    const float right = x - i, below = y - j;
    int left = i, next = i + 1, upper = j, lower = j + 1;
    if (is_cube) {
        left = left < 0 ? 0 : left;
        upper = upper < 0 ? 0 : upper;
        next = next < width ? next : width - 1;
        lower = lower < height ? lower : height - 1;
    } else {
        left = left < 0 ? width - 1 : left;
        upper = upper < 0 ? height - 1 : upper;
        next = next < width ? next : 0;
        lower = lower < height ? lower : 0;
    }
    const unsigned *const data = texels.data + start + face * width * height;
    const auto color = [&](int row, int column) {
        return __builtin_convertvector(*(const bytes *)(data + row * width + column), floats);
    };
    if (has_next) share = level ? covered - 1.0f : 2.0f - covered;
    const float of_c = share * (1.0f - right) * below, of_d = share * right * below;
    const float of_a = share * (1.0f - right) - of_c, of_b = share * right - of_d;
    total += of_a * color(upper, left) + of_b * color(upper, next)
        + of_c * color(lower, left) + of_d * color(lower, next);
    start += width * height * image.faces;
    width = width > 1 ? width / 2 : 1;
    height = height > 1 ? height / 2 : 1;
}
total *= 1.0f / 255.0f;
"""
"""Sets `total` to the color of a texture, see `sample_levels`; it changes `covered`."""


@wp.func_native(f"""
{SAMPLE}
return wp::vec_t<3, float>(total[0], total[1], total[2]);
""")
def sample_levels(
    texels: wp.array[wp.uint32], image: Image, face: int, across: float, down: float, covered: float
) -> wp.vec3:
    """Interpolate between texels and between mip levels, at coordinates from 0 to 1.

    A pixel is `covered` texels wide. Flat textures repeat; faces of cube maps end at their edges.
    """
    ...
