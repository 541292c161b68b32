"""AirSim's seven image types, computed from rendered modalities, and its segmentation ids."""

import dataclasses
import enum
import functools
import math
import random
from collections.abc import Sequence

import torch
from torch import Tensor

from drone_rl.sim.entities import find_camera
from drone_rl.sim.rendering import Scene
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError

NUM_IDS = 256
"""Number of segmentation ids; the sky has 0."""
_SEED = 42
"""Seed of AirSim's colours."""


@functools.cache
def palette() -> Tensor:
    """Return AirSim's colours: red, green, blue of each id. Shape: (256, 3), uint8.

    Each channel, from blue to red, is a random permutation; then id 0 is black and 255 white.
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
    """Return the object that each geom belongs to: "ground", "target_0", "obstacle_2"."""
    pairs = zip(scene.semantic_classes, scene.props, strict=True)
    return [of.name.lower() + (f"_{prop}" if prop >= 0 else "") for of, prop in pairs]


def default_id(name: str) -> int:
    """Return AirSim's id of an object by its name; digits do not count."""
    return (5 + sum(ord(letter) for letter in name.lower() if letter >= "a")) % NUM_IDS


def default_ids(scene: Scene) -> Tensor:
    """Return AirSim's ids of the geoms of a scene. Shape: (num_geoms,), int64."""
    return torch.tensor([default_id(name) for name in object_names(scene)])


def check_ids(ids: Tensor, num_geoms: int) -> Tensor:
    """Check segmentation ids of geoms. Shape: (num_geoms,).

    Raises:
        InputError: There are more or fewer, or one is not a whole number from 0 to 255.
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
"""Depth that is shown white, metres."""
BASELINE = 0.25
"""Distance between the two cameras of a stereo pair, in metres."""


class ImageType(enum.IntEnum):
    """What a pixel holds, by AirSim's numbers."""

    SCENE = 0
    """Colour."""
    DEPTH_PLANAR = 1
    """Distance along the camera's axis, metres."""
    DEPTH_PERSPECTIVE = 2
    """Distance along the pixel's own ray, metres."""
    DEPTH_VIS = 3
    """`DEPTH_PLANAR` as brightness: black at 0 m, white from 100 m, linear between."""
    DISPARITY_NORMALIZED = 4
    """Shift in a second camera 0.25 m to the right, as a fraction of the image's width."""
    SEGMENTATION = 5
    """Colour of the object's id, see `palette`."""
    SURFACE_NORMALS = 6
    """Direction of the surface."""

    @property
    def modality(self) -> Modality:
        """The modality from which it is computed."""
        return _MODALITIES[self]


_DISTANCES: tuple[Modality, ...] = ("depth", "distance", "depth", "depth")
_MODALITIES: tuple[Modality, ...] = ("rgb", *_DISTANCES, "segmentation", "normals")
"""By number of the image type."""


@dataclasses.dataclass(frozen=True)
class ImageRequest:
    """One image.

    Raises:
        InputError: The camera or type is unknown.
    """

    camera: str | int = "front_center"
    """AirSim's name or number."""
    image_type: ImageType | int = ImageType.SCENE
    """What its pixels hold."""
    as_float: bool = False
    """Whether pixels are numbers (`pixels_as_float`) instead of red, green and blue."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "camera", find_camera(self.camera).name)
        if self.image_type not in list(ImageType):
            names = ", ".join(f"{kind.value} ({kind.name.lower()})" for kind in ImageType)
            raise InputError(f"image_type={self.image_type!r} is unknown; give one of: {names}")
        object.__setattr__(self, "image_type", ImageType(self.image_type))


def images(
    worlds: Worlds,
    state: State | None,
    requests: Sequence[ImageRequest],
    *,
    height: int | None = None,
    width: int | None = None,
    ids: Tensor | None = None,
) -> list[Tensor]:
    """Render several images of each environment, of one size, in one pass.

    Args:
        worlds: Batch of environments to render.
        state: Their state; the current one by default.
        requests: Camera and type of each image.
        height: Pixels, as `width`; by default that of the policy's camera.
        width: See `height`. Cameras keep their vertical field of view.
        ids: Segmentation ids of the geoms, 0 to 255; AirSim's by default. Shape: (num_geoms,).

    Returns:
        One for each request; see `pixels` for types and shapes.

    Raises:
        InputError: There are no requests, a size or an id is out of range, or the renderer does not
            support a type.
    """
    cameras = list(dict.fromkeys(str(request.camera) for request in requests))
    kinds = [ImageType(request.image_type) for request in requests]
    wanted: list[Modality] = list(dict.fromkeys(kind.modality for kind in kinds))
    view = worlds.view(cameras, wanted, height, width)
    scene = worlds.scene
    known = default_ids(scene) if ids is None else check_ids(ids, scene.model.ngeom)
    rendered = worlds.render_all(worlds.state if state is None else state, view)
    found = []
    for request, kind in zip(requests, kinds, strict=True):
        number = cameras.index(str(request.camera))
        fov = float(scene.model.cam_fovy[scene.camera(view.cameras[number])])
        focal = view.height / 2 / math.tan(math.radians(fov) / 2)
        values = rendered[kind.modality][:, number]
        found.append(pixels(kind, values, as_float=request.as_float, focal=focal, ids=known))
    return found


def pixels(
    image_type: ImageType,
    values: Tensor,
    *,
    as_float: bool = False,
    focal: float = 1.0,
    ids: Tensor | None = None,
) -> Tensor:
    """Convert a rendered image to an image type.

    Disparity is (Xl - Xr) / width: `focal * BASELINE / depth / width`.

    Args:
        image_type: The type.
        values: Image of its modality, see `Renderer.render`. Shape: (*, H, W) or (*, H, W, 3).
        as_float: Whether to return numbers.
        focal: Focal length in pixels, for disparity.
        ids: Segmentation ids of the geoms; their indices by default. Shape: (num_geoms,).

    Returns:
        As numbers, float32, shape (*, H, W): metres of depth, at most `FARTHEST`, also where
        nothing is hit; a fraction of white, of the width, or of red for all other types. Otherwise
        uint8, red, green and blue, shape (*, H, W, 3): depth in whole metres up to 255, fractions
        in 255ths, both in gray; normals from -1 to 1 as 0 to 255 along our world's x, y and z,
        black where nothing is hit.
    """
    if image_type is ImageType.SCENE:
        return _color(values, as_float)
    if image_type is ImageType.SEGMENTATION:
        geoms = values.long()
        known = geoms if ids is None else ids.to(geoms.device)[geoms.clamp(min=0)]
        colors = palette().to(geoms.device)[torch.where(geoms < 0, 0, known)]
        return _color(colors, as_float)
    if image_type is ImageType.SURFACE_NORMALS:
        is_hit = (values != 0).any(-1, keepdim=True)
        colors = ((values + 1) * 127.5 * is_hit).round().clamp(0, 255).to(torch.uint8)
        return _color(colors, as_float)
    depth = torch.where(values > 0, values, FARTHEST).clamp(max=FARTHEST)
    if image_type is ImageType.DEPTH_VIS:
        return _gray((depth / WHITE_DEPTH).clamp(max=1.0), as_float, 255.0)
    if image_type is ImageType.DISPARITY_NORMALIZED:
        share = focal * BASELINE / values.shape[-1] / depth * (values > 0)
        return _gray(share.clamp(max=1.0), as_float, 255.0)
    return _gray(depth, as_float, 1.0)


def _color(colors: Tensor, as_float: bool) -> Tensor:
    return colors[..., 0].float() / 255.0 if as_float else colors


def _gray(values: Tensor, as_float: bool, white: float) -> Tensor:
    if as_float:
        return values
    level = (values * white).round().clamp(max=255.0).to(torch.uint8)
    return level[..., None].expand(*level.shape, 3)
