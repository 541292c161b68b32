"""Structs of the ray tracer's kernels. A batch has a row per image, environment by environment."""

from typing import TypeVar

import warp as wp

_Struct = TypeVar("_Struct")

RGB = wp.constant(1)
GRAY = wp.constant(2)
DEPTH = wp.constant(4)
DISTANCE = wp.constant(8)
SEGMENTATION = wp.constant(16)
NORMALS = wp.constant(32)
"""Modalities, one bit each: their sum, `ViewArrays.what`, is rendered in one pass."""
DISTANCES = wp.constant(4 | 8)
"""Modalities that are read from `Scratch.nearest`."""

DRONE_FRAME = wp.constant(1)
"""The only frame that rotates. Frame 0 is the world, and frames from 2 are the props."""
NO_GEOM = wp.constant(-1)
"""Owner of a pixel that shows the sky."""
FACES = wp.constant(8)
"""An owner is `FACES` times the index of a rendered geom, plus the face."""


def struct(cls: type[_Struct]) -> type[_Struct]:
    """Make a Warp struct of a class, and keep its type for type checkers."""
    return wp.struct(cls)


@struct
class Camera:
    """One camera of a view: its pose in its frame, and half sizes of its image plane at distance 1.

    It looks along its own -z, with y up. Metres, quaternion (w, x, y, z).
    """

    frame: int
    position: wp.vec3
    attitude: wp.vec4
    half_width: float
    half_height: float


@struct
class ViewArrays:
    """All cameras of a view, which share one image size."""

    count: int
    """Cameras per environment."""
    cameras: wp.array[Camera]
    """Shared by all environments, or those of the first environment, of the second, ..."""
    rays: wp.array2d[wp.vec3]
    """Unit directions in each camera's frame, of all pixels, row by row."""
    cosines: wp.array2d[float]
    """Cosine of the angle between each ray and its camera's axis."""
    width: int
    height: int
    far: float
    """Metres along the axis beyond which nothing is rendered."""
    what: int


@struct
class Geoms:
    """The rendered geoms, in the model's order."""

    kind: wp.array[int]
    number: wp.array[int]
    """Index in the model."""
    frame: wp.array[int]
    position: wp.array[wp.vec3]
    attitude: wp.array[wp.vec4]
    size: wp.array[wp.vec3]
    reach: wp.array[wp.vec3]
    """Half extents of the bounding box in the geom's frame."""


@struct
class PoseArrays:
    """Poses of the frames. Metres, quaternions (w, x, y, z). Shape: (num_envs, num_frames)."""

    positions: wp.array2d[wp.vec3]
    attitudes: wp.array[wp.vec4]
    """Of the drones alone. Shape: (num_envs,)."""
    scales: wp.array2d[float]
    """Size of a frame's geoms relative to the model, or no array."""


@struct
class Materials:
    """Colors and lights; first dimension: one for all environments or one each."""

    colors: wp.array2d[wp.vec3]
    ambient: wp.array2d[wp.vec3]
    diffuse: wp.array2d[wp.vec3]
    direction: wp.array2d[wp.vec3]
    sky: wp.array[wp.vec3]
    """Whole numbers from 0 to 255."""


@struct
class Effects:
    """Sky gradient, fog, shadows and textures; first dimension as in `Materials`."""

    zenith: wp.array[wp.vec3]
    """Of the sky overhead, 0 to 255; `Materials.sky` is at the horizon."""
    extinction: wp.array[float]
    """Of fog, per metre; 0 for clear air."""
    shadows: wp.array[int]
    """Whether the first light casts shadows."""
    texture: wp.array2d[int]
    """Of each geom in the model; -1 for none."""
    tiles: wp.array2d[float]
    """Tiles per metre of each geom."""
    sides: wp.array[int]
    """Texels along the side of each texture: a power of 2."""
    starts: wp.array[int]
    """First texel of each texture, whose mip levels follow each other."""
    texels: wp.array[wp.uint32]
    """Red in the lowest 8 bits, then green, then blue."""


@struct
class Images:
    """Outputs. Shapes: (num_images, num_pixels)."""

    rgb: wp.array2d[wp.vec3ub]
    gray: wp.array2d[float]
    depth: wp.array2d[float]
    distance: wp.array2d[float]
    segmentation: wp.array2d[int]
    normals: wp.array2d[wp.vec3]


@struct
class GeomView:
    """One geom relative to one camera of one environment."""

    kind: int
    number: int
    size: wp.vec3
    reach: wp.vec3
    eye: wp.vec3
    """The camera's position in the geom's frame."""
    into: wp.mat33
    """Rotates directions from the camera's frame to the geom's."""
    axes: wp.mat33
    """Rotates directions from the geom's frame to the world's."""


@struct
class PixelValue:
    """Everything that a pixel shows except its distance; normals are 0 for the sky."""

    number: int
    """Geom index in the model; -1 for the sky."""
    face: int
    """See `intersection_kernel.ROUND`."""
    face_normal: wp.vec3
    """In the geom's frame."""
    normal: wp.vec3
    """World frame."""
    color: wp.vec3ub
    gray: float


@struct
class SurfaceLight:
    """Colors, 0 to 255 or more, of a surface in the sun and in shadow, and its fog."""

    lit: wp.vec3
    shaded: wp.vec3
    extinction: float
    horizon: wp.vec3


@struct
class TextureMap:
    """A texture, see `Effects.starts` and `sides`, projected onto a face, for one camera."""

    start: int
    side: int
    across: wp.vec3
    """Tiles across the texture per unit along a ray: dot product with the ray."""
    down: wp.vec3
    corner: wp.vec2
    """The camera's position, tiles across and down."""
    facing: wp.vec3
    """Opposite of the face's normal, camera frame."""
    area: float
    """Texels of the finest level that the central pixel covers at 1 m."""


@struct
class Scratch:
    """Working memory; a row for each worker (CPU) or each image (GPU)."""

    nearest: wp.array2d[float]
    """Distance along each pixel's ray to the nearest surface."""
    owner: wp.array2d[int]
    """Which surface that is: see `FACES` and `NO_GEOM`."""
    dark: wp.array2d[int]
    """Whether that surface is in shadow; used with shadows only."""
    colors: wp.array2d[wp.vec3ub]
    """Colors, where they differ from pixel to pixel."""
    geom_views: wp.array2d[GeomView]


@struct
class Job:
    """One image to render: the camera in its environment, and one worker's part of `Scratch`."""

    row: int
    env: int
    view: ViewArrays
    camera: Camera
    eye: wp.vec3
    """The camera's position, world frame."""
    camera_to_world: wp.mat33
    """Rotates directions from the camera's frame to the world's."""
    rays: wp.array[wp.vec3]
    cosines: wp.array[float]
    nearest: wp.array[float]
    owner: wp.array[int]
    dark: wp.array[int]
    colors: wp.array[wp.vec3ub]
    geom_views: wp.array[GeomView]
