"""Eight of AirSim's image types, computed from rendered modalities, and its segmentation ids."""

import dataclasses
import enum
import functools
import io
import math
import random
from collections.abc import Sequence

import torch
from PIL import Image
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


@functools.cache
def palette() -> Tensor:
    """Return AirSim's colors: red, green, blue of each id. Shape: (256, 3), uint8.

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


def segmentation_ids(scene: Scene) -> Tensor:
    """Return AirSim's ids of geoms, by their classes' names, and of the sky, which has index -1.

    Shape: (num_geoms + 1,), int64.
    """
    names = [semantic_class.name.lower() for semantic_class in scene.semantic_classes]
    return torch.tensor([*((5 + sum(map(ord, name))) % NUM_IDS for name in names), 0])


MAX_DEPTH = 65504.0
"""Depth where nothing is hit, and the largest depth, metres."""
WHITE_DEPTH = 100.0
"""Depth that is shown white, metres."""
BASELINE = 0.25
"""Distance between the two cameras of a stereo pair, in metres."""


class ImageType(enum.IntEnum):
    """What a pixel holds, by AirSim's numbers."""

    SCENE = 0
    DEPTH_PLANAR = 1
    """Distance along the camera's axis, metres."""
    DEPTH_PERSPECTIVE = 2
    """Distance along the pixel's own ray, metres."""
    DEPTH_VIS = 3
    """`DEPTH_PLANAR` as brightness: black at 0 m, white from 100 m, linear between."""
    DISPARITY_NORMALIZED = 4
    """Shift in a second camera 0.25 m to the right, as a fraction of the image's width."""
    SEGMENTATION = 5
    """Color of the object's id, see `palette`."""
    SURFACE_NORMALS = 6
    INFRARED = 7
    """The object's id in gray."""

    @property
    def modality(self) -> Modality:
        """The modality from which it is computed."""
        return _MODALITIES[self]


_DISTANCES: tuple[Modality, ...] = ("depth", "distance", "depth", "depth")
_MODALITIES: tuple[Modality, ...] = (
    *("rgb", *_DISTANCES),
    *("segmentation", "normals", "segmentation"),
)
"""By number of the image type."""


@dataclasses.dataclass(frozen=True)
class ImageRequest:
    """One image, as in Listing 3: `ImageRequest(0, ImageType.SCENE, False, False)`.

    Raises an `InputError` if the camera or type is unknown, or numbers are to be compressed.
    """

    camera: str | int = "front_center"
    """AirSim's name or number: 0 front center, 1 front right, 2 front left, 3 bottom center, 4 back
    center, as from version 1.1.3 on. The chapter's text calls its front center camera 1."""
    image_type: ImageType | int = ImageType.SCENE
    as_float: bool = False
    """Whether pixels are numbers (`pixels_as_float`) instead of red, green and blue."""
    compress: bool = False
    """Whether the image is encoded as PNG."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "camera", find_camera(self.camera).name)
        if self.image_type not in list(ImageType):
            names = ", ".join(f"{kind.value} ({kind.name.lower()})" for kind in ImageType)
            raise InputError(f"image_type={self.image_type!r} is unknown; give one of: {names}")
        object.__setattr__(self, "image_type", ImageType(self.image_type))
        if self.as_float and self.compress:
            raise InputError("as_float=True and compress=True are both given; PNG holds bytes only")


def images(
    worlds: Worlds,
    state: State,
    requests: Sequence[ImageRequest],
    *,
    height: int | None = None,
    width: int | None = None,
) -> list[Tensor]:
    """Render several images of one environment in a state, of one size, in one pass.

    For their shapes see `pixels`; a compressed image is a PNG file of shape (bytes,), uint8.

    The default size, in pixels, is that of the policy's camera; cameras keep their vertical field
    of view. Raises an `InputError` if there are no requests, a size is out of range, or the
    renderer does not support a type.
    """
    cameras = list(dict.fromkeys(str(request.camera) for request in requests))
    kinds = [ImageType(request.image_type) for request in requests]
    wanted: list[Modality] = list(dict.fromkeys(kind.modality for kind in kinds))
    view, scene = worlds.view(cameras, wanted, height, width), worlds.scene
    ids, rendered = segmentation_ids(scene), worlds.render_all(state, view)
    pictures: list[Tensor] = []
    for request, kind in zip(requests, kinds, strict=True):
        number = cameras.index(str(request.camera))
        fov = float(scene.model.cam_fovy[scene.camera(view.cameras[number])])
        focal = view.height / 2 / math.tan(math.radians(fov) / 2)
        values = rendered[kind.modality][0, number]
        image = pixels(kind, values, as_float=request.as_float, focal=focal, ids=ids)
        if request.compress:
            content = encode(Image.fromarray(image.cpu().numpy()), "png")
            image = torch.frombuffer(bytearray(content), dtype=torch.uint8)
        pictures.append(image)
    return pictures


def encode(image: Image.Image, kind: str, *, quality: int = -1, compress_level: int = -1) -> bytes:
    """Return the content of an image file: "jpeg" of a quality, or "png" of a compression.

    Both are PIL's, -1 for its default.
    """
    buffer = io.BytesIO()
    image.save(buffer, kind, quality=quality, compress_level=compress_level)
    return buffer.getvalue()


def pixels(
    image_type: ImageType,
    values: Tensor,
    *,
    as_float: bool = False,
    focal: float = 1.0,
    ids: Tensor | None = None,
) -> Tensor:
    """Convert a rendered image of the type's modality, see `Renderer.render`, to an image type.

    `focal` is the focal length in pixels, for disparity. `ids` are the segmentation ids of the
    geoms and, last, of the sky, (num_geoms + 1,), by default the geoms' indices and 0.

    Returns:
        As numbers, float32, shape (*, H, W): metres of depth, at most `MAX_DEPTH`, also where
        nothing is hit; a fraction of white, of the width, or of red for all other types. Otherwise
        uint8, red, green and blue, shape (*, H, W, 3): depth in whole metres up to 255, fractions
        in 255ths, both in gray; normals from -1 to 1 as 0 to 255 along our world's x, y and z,
        black where nothing is hit.
    """
    if image_type is ImageType.SCENE:
        return _color(values, as_float)
    if image_type.modality == "segmentation":
        geoms = values.long()
        numbers = geoms.clamp(min=0) if ids is None else ids.to(geoms.device)[geoms]
        if image_type is ImageType.INFRARED:
            return _gray(numbers.float() / 255.0, as_float, 255.0)
        colors = palette().to(geoms.device)[numbers]
        return _color(colors, as_float)
    if image_type is ImageType.SURFACE_NORMALS:
        is_hit = (values != 0).any(-1, keepdim=True)
        colors = ((values + 1) * 127.5 * is_hit).round().clamp(0, 255).to(torch.uint8)
        return _color(colors, as_float)
    depth = torch.where(values > 0, values, MAX_DEPTH).clamp(max=MAX_DEPTH)
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
