# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""What the ray tracer's kernels are given, and the numbers that stand for things in them."""

import warp as wp

RGB = wp.constant(1)
GRAY = wp.constant(2)
DEPTH = wp.constant(4)
DISTANCE = wp.constant(8)
SEGMENTATION = wp.constant(16)
NORMALS = wp.constant(32)
"""What a picture shows, a bit each, so that a sum of them is what is drawn in one pass."""

DRONE_FRAME = wp.constant(1)
"""The only frame that turns; 0 is the world's and the props' follow."""


@wp.struct
class Camera:
    """One camera of a view."""

    frame: int
    position: wp.vec3
    """In its frame, metres."""
    attitude: wp.vec4
    """In its frame, (w, x, y, z); it looks along its own -z, with y up."""
    half_width: float
    """Of the picture at a distance of 1."""
    half_height: float


@wp.struct
class View:
    """All cameras of a view, whose pictures are of one size."""

    count: int
    """Of cameras of a world."""
    cameras: wp.array[Camera]
    """Of all worlds alike, or those of the first world, of the second, ..."""
    rays: wp.array2d[wp.vec3]
    """Directions of length 1 in each camera's frame, of all pixels, row by row."""
    cosines: wp.array2d[float]
    """Of the angles between rays and their camera's axis."""
    width: int
    height: int
    far: float
    """Metres along the axis beyond which nothing is drawn."""
    what: int
    """A sum of `RGB` and so on."""


@wp.struct
class Geoms:
    """What is drawn, in the model's order."""

    kind: wp.array[int]
    number: wp.array[int]
    """In the model."""
    frame: wp.array[int]
    position: wp.array[wp.vec3]
    attitude: wp.array[wp.vec4]
    size: wp.array[wp.vec3]
    reach: wp.array[wp.vec3]
    """Half extents of the box around each, in its own frame."""


@wp.struct
class Poses:
    """Where frames are in each world."""

    places: wp.array2d[wp.vec3]
    """Shape: (num_worlds, num_frames)."""
    attitudes: wp.array[wp.vec4]
    """Of the drones, quaternions (w, x, y, z) of length 1. Shape: (num_worlds,)."""
    scales: wp.array2d[float]
    """How many times as large as in the model what a frame carries is; none where nothing differs.
    Shape: as that of `places`."""


@wp.struct
class Looks:
    """Colours and light; first dimension: one for all worlds or one for each."""

    colors: wp.array2d[wp.vec3]
    ambient: wp.array2d[wp.vec3]
    diffuse: wp.array2d[wp.vec3]
    direction: wp.array2d[wp.vec3]
    sky: wp.array[wp.vec3]
    """Whole numbers from 0 to 255."""


@wp.struct
class Scenery:
    """What makes a world look like something; first dimension as in `Looks`."""

    zenith: wp.array[wp.vec3]
    """Of the sky overhead, from 0 to 255; at the horizon it has `Looks.sky`."""
    fog: wp.array[float]
    """Share of the light that is lost in a metre, by its logarithm; 0 for none."""
    shadows: wp.array[int]
    """Whether the first light casts any."""
    texture: wp.array2d[int]
    """Of each geom in the model; -1 for none."""
    tiles: wp.array2d[float]
    """Of each geom, in a metre."""
    sides: wp.array[int]
    """Of each texture, texels: a power of 2."""
    starts: wp.array[int]
    """Where the texels of each texture begin: its own, then those of half the side, down to 1."""
    texels: wp.array[wp.uint32]
    """Red in the lowest 8 bits, then green, then blue."""


@wp.struct
class Pictures:
    """What is drawn into, a row a picture: all cameras of the first world, of the second, ..."""

    rgb: wp.array2d[wp.vec3ub]
    gray: wp.array2d[float]
    depth: wp.array2d[float]
    distance: wp.array2d[float]
    segmentation: wp.array2d[int]
    normals: wp.array2d[wp.vec3]


@wp.struct
class Sight:
    """One geom as one world's camera sees it."""

    kind: int
    number: int
    size: wp.vec3
    reach: wp.vec3
    eye: wp.vec3
    """The camera's place in the geom's frame."""
    into: wp.mat33
    """Turns directions from the camera's frame to the geom's."""
    axes: wp.mat33
    """The same from the geom's to the world's."""
