"""AirSim's seven image types, computed from what a renderer draws, and its segmentation ids."""

import dataclasses
import enum
import functools
import math
import random
from collections.abc import Sequence

import torch
from torch import Tensor

from drone_rl.sim.entities import find_camera
from drone_rl.sim.rendering import Appearance, Scene
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError

NUM_IDS = 256
"""Numbers that there are, from 0, which is that of the sky."""
_SEED = 42
"""Of the draw that AirSim's colours came out of."""


@functools.cache
def palette() -> Tensor:
    """AirSim's colours. Shape: (256, 3), uint8: red, green, blue of each number.

    Each channel, from blue to red, has the 256 values in an order drawn by chance; then number 0 is
    black and 255 white.
    """
    draw = random.Random(_SEED)
    colors = torch.zeros(NUM_IDS, 3, dtype=torch.uint8)
    for channel in (2, 1, 0):
        left = list(range(256))
        for number in range(NUM_IDS):
            colors[number, channel] = left.pop(draw.randrange(len(left)))
    colors[0], colors[-1] = 0, 255
    return colors


def object_names(scene: Scene) -> list[str]:
    """What AirSim's functions may call each geom of a scene: "ground", "target_0", "obstacle_2".

    Geoms of one thing share its name, as do those that belong to none and mean the same.
    """
    pairs = zip(scene.semantic_classes, scene.props, strict=True)
    return [
        meaning.name.lower() if prop < 0 else f"{meaning.name.lower()}_{prop}"
        for meaning, prop in pairs
    ]


def default_id(name: str) -> int:
    """The number that AirSim gives a thing by its name alone.

    Things whose names differ in digits only have the same.
    """
    return (5 + sum(ord(letter) for letter in name.lower() if letter >= "a")) % NUM_IDS


def default_ids(scene: Scene) -> Tensor:
    """The same of each geom of a scene. Shape: (num_geoms,), int64."""
    return torch.tensor([default_id(name) for name in object_names(scene)])


def check_ids(ids: Tensor, num_geoms: int) -> Tensor:
    """Numbers of geoms, as they may be given.

    Args:
        ids: Shape: (num_geoms,), whole numbers.
        num_geoms: How many geoms there are.

    Raises:
        InputError: There are more or fewer, or one is no number from 0 to 255.
    """
    if ids.shape != (num_geoms,):
        raise InputError(
            f"ids of shape {tuple(ids.shape)} don't fit {num_geoms} geoms; give one for each"
        )
    for number in ids.tolist():
        if number not in range(NUM_IDS):
            raise InputError(f"id {number} is out of range; give whole numbers from 0 to 255")
    return ids.long()


FARTHEST = 65504.0
"""Depth where nothing is hit, and the largest depth, metres."""
WHITE_DEPTH = 100.0
"""Depth at which pictures of depth are white, in metres."""
BASELINE = 0.25
"""Distance between the two cameras of a stereo pair, in metres."""


class ImageType(enum.IntEnum):
    """What a pixel says, by AirSim's numbers."""

    SCENE = 0
    """Colour."""
    DEPTH_PLANAR = 1
    """Distance along the camera's axis, metres."""
    DEPTH_PERSPECTIVE = 2
    """Distance along the pixel's own ray, metres."""
    DEPTH_VIS = 3
    """The first of these as a picture: black at 0 m, white from 100 m on, linear between."""
    DISPARITY_NORMALIZED = 4
    """By how much less to the right a second camera, 0.25 m to the right, would see the same,
    as a share of the picture's width."""
    SEGMENTATION = 5
    """Which thing, see `segmentation`."""
    SURFACE_NORMALS = 6
    """Which way the surface looks."""

    @property
    def modality(self) -> Modality:
        """The modality from which it is computed."""
        return _MODALITIES[self]


_MODALITIES: dict[ImageType, Modality] = {
    ImageType.SCENE: "rgb",
    ImageType.DEPTH_PLANAR: "depth",
    ImageType.DEPTH_PERSPECTIVE: "distance",
    ImageType.DEPTH_VIS: "depth",
    ImageType.DISPARITY_NORMALIZED: "depth",
    ImageType.SEGMENTATION: "segmentation",
    ImageType.SURFACE_NORMALS: "normals",
}


@dataclasses.dataclass(frozen=True)
class ImageRequest:
    """One image.

    Raises:
        InputError: There is no such camera or type.
    """

    camera: str | int = "front_center"
    """AirSim's name or number."""
    image_type: ImageType | int = ImageType.SCENE
    """What its pixels say."""
    as_float: bool = False
    """Whether they are numbers (`pixels_as_float`), not red, green and blue."""

    def __post_init__(self) -> None:
        """Check camera and type."""
        object.__setattr__(self, "camera", find_camera(self.camera).name)
        if self.image_type not in list(ImageType):
            names = ", ".join(f"{kind.value} ({kind.name.lower()})" for kind in ImageType)
            raise InputError(f"image_type={self.image_type!r} is unknown; give one of: {names}")
        object.__setattr__(self, "image_type", ImageType(self.image_type))


def image(
    worlds: Worlds,
    state: State | None = None,
    camera: str | int = "front_center",
    image_type: ImageType | int = ImageType.SCENE,
    *,
    as_float: bool = False,
    height: int | None = None,
    width: int | None = None,
    ids: Tensor | None = None,
    appearance: Appearance | None = None,
) -> Tensor:
    """Return one image of each environment; see `images`."""
    request = ImageRequest(camera, image_type, as_float)
    (drawn,) = images(
        worlds, state, [request], height=height, width=width, ids=ids, appearance=appearance
    )
    return drawn


def images(
    worlds: Worlds,
    state: State | None,
    requests: Sequence[ImageRequest],
    *,
    height: int | None = None,
    width: int | None = None,
    ids: Tensor | None = None,
    appearance: Appearance | None = None,
) -> list[Tensor]:
    """Render several images of each environment, of one size, in one pass.

    Args:
        worlds: Which draw.
        state: What is drawn; the worlds' own by default.
        requests: Which images.
        height: Pixels down; the policy's camera's by default.
        width: Pixels across; the same's. Cameras keep their vertical field of view.
        ids: Numbers of the geoms in pictures of segments; AirSim's own by default. Shape:
            (num_geoms,), 0 to 255.
        appearance: See `Worlds.render`.

    Returns:
        One for each request; see `pixels` for types and shapes.

    Raises:
        InputError: Nothing is asked for, a size or an id is out of range, or the worlds' renderer
            can't draw it.
    """
    cameras = list(dict.fromkeys(str(request.camera) for request in requests))
    kinds = [ImageType(request.image_type) for request in requests]
    wanted: list[Modality] = list(dict.fromkeys(kind.modality for kind in kinds))
    view = worlds.view(cameras, wanted, height, width)
    scene = worlds.scene
    known = default_ids(scene) if ids is None else check_ids(ids, scene.model.ngeom)
    drawn = worlds.render_all(worlds.state if state is None else state, view, appearance)
    found = []
    for request, kind in zip(requests, kinds, strict=True):
        number = cameras.index(str(request.camera))
        fov = float(scene.model.cam_fovy[scene.camera(view.cameras[number])])
        focal = view.height / 2 / math.tan(math.radians(fov) / 2)
        picture = drawn[kind.modality][:, number]
        found.append(pixels(kind, picture, as_float=request.as_float, focal=focal, ids=known))
    return found


def pixels(
    image_type: ImageType,
    picture: Tensor,
    *,
    as_float: bool = False,
    focal: float = 1.0,
    ids: Tensor | None = None,
) -> Tensor:
    """An image out of what a renderer draws for it.

    Args:
        image_type: Which.
        picture: Of its modality, see `Renderer.render`. Shape: (*, H, W) or (*, H, W, 3).
        as_float: Whether numbers are wanted.
        focal: Focal length in pixels; only disparity needs it.
        ids: Numbers of the geoms; each its own by default. Shape: (num_geoms,).

    Returns:
        As numbers, float32, shape (*, H, W): metres of depth, up to `FARTHEST`, which stands where
        nothing is hit too; a share of white, of the width, or of red in all other types. Otherwise
        uint8, red, green and blue, shape (*, H, W, 3): depth in whole metres up to 255, shares in
        255ths, both in grey; normals from -1 to 1 as 0 to 255 along our world's x, y and z, black
        where nothing is hit.
    """
    if image_type is ImageType.SCENE:
        return _chosen(picture, as_float)
    if image_type is ImageType.SEGMENTATION:
        return _chosen(segments(picture, ids), as_float)
    if image_type is ImageType.SURFACE_NORMALS:
        return _chosen(normals(picture), as_float)
    if image_type is ImageType.DEPTH_VIS:
        return _gray(depth_vis(picture), as_float, 255.0)
    if image_type is ImageType.DISPARITY_NORMALIZED:
        return _gray(disparity(picture, focal), as_float, 255.0)
    return _gray(_depth(picture), as_float, 1.0)


def depth_vis(depth: Tensor) -> Tensor:
    """Share of white. Shape: (*), of metres along the axis, 0 where nothing is hit."""
    return (_depth(depth) / WHITE_DEPTH).clamp(max=1.0)


def disparity(depth: Tensor, focal: float) -> Tensor:
    """Disparity as a share of the width, (Xl - Xr) / width: `focal * BASELINE / depth / width`.

    Args:
        depth: Metres along the axis, 0 where nothing is hit. Shape: (*, H, W).
        focal: Focal length in pixels.

    Returns:
        From 0, where nothing is hit, to 1. Shape: (*, H, W).
    """
    return (focal * BASELINE / depth.shape[-1] / _depth(depth) * (depth > 0)).clamp(max=1.0)


def segments(picture: Tensor, ids: Tensor | None = None) -> Tensor:
    """Colours of things.

    Args:
        picture: Numbers of geoms, -1 where nothing is hit. Shape: (*).
        ids: AirSim's numbers of the geoms; each its own by default. Shape: (num_geoms,).

    Returns:
        Shape: (*, 3), uint8.
    """
    geoms = picture.long()
    known = geoms if ids is None else ids.to(geoms.device)[geoms.clamp(min=0)]
    return palette().to(geoms.device)[torch.where(geoms < 0, 0, known)]


def normals(picture: Tensor) -> Tensor:
    """Directions as colours.

    Args:
        picture: Of length 1, or 0 where nothing is hit. Shape: (*, 3).

    Returns:
        Shape: (*, 3), uint8.
    """
    is_hit = (picture != 0).any(-1, keepdim=True)
    return ((picture + 1) * 127.5 * is_hit).round().clamp(0, 255).to(torch.uint8)


def _depth(depth: Tensor) -> Tensor:
    return torch.where(depth > 0, depth, FARTHEST).clamp(max=FARTHEST)


def _chosen(colors: Tensor, as_float: bool) -> Tensor:
    return colors[..., 0].float() / 255.0 if as_float else colors


def _gray(values: Tensor, as_float: bool, white: float) -> Tensor:
    if as_float:
        return values
    level = (values * white).round().clamp(max=255.0).to(torch.uint8)
    return level[..., None].expand(*level.shape, 3)
