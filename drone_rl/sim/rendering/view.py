"""Requests to a renderer: cameras, image size and modalities; RGB to grayscale."""

import dataclasses
from collections.abc import Container
from typing import Literal, get_args

import torch
from torch import Tensor

from drone_rl.utils.errors import InputError

Modality = Literal["rgb", "gray", "depth", "distance", "segmentation", "normals"]
"""What a pixel holds: color, brightness, depth along the camera's axis, distance along the pixel's
ray, geom index, surface normal."""
MODALITIES: tuple[Modality, ...] = get_args(Modality)
_KINDS: dict[Modality, tuple[torch.dtype, tuple[int, ...]]] = {
    "rgb": (torch.uint8, (3,)),
    **dict.fromkeys(("gray", "depth", "distance"), (torch.float32, ())),
    "segmentation": (torch.int32, ()),
    "normals": (torch.float32, (3,)),
}
LUMA = (0.299, 0.587, 0.114)
"""Weights of red, green and blue in a gray pixel (ITU-R BT.601), as in the original study."""
WEIGHTS = tuple((torch.tensor(LUMA) / 255.0).tolist())
"""The same for bytes, rounded to float32, so that gray is in [0, 1]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class View:
    """Cameras and modalities to render, all at one image size; invalid ones raise `InputError`."""

    cameras: tuple[str, ...]
    """Full names of cameras in the model, such as "drone/front_center"."""
    height: int
    """Pixels, 1 to 4096, as `width`."""
    width: int
    modalities: tuple[Modality, ...] = ("rgb",)
    show_drone: bool = False
    """Whether to render the drone's own body, which its own cameras leave out."""
    horizontal_fov: float | None = None
    """Horizontal field of view, degrees; the cameras' own if None."""

    def __post_init__(self) -> None:
        if not self.cameras:
            raise InputError("cameras=() shows nothing; name a camera or more")
        if not self.modalities:
            raise InputError(f"modalities=() shows nothing; give {_one_of(MODALITIES)}")
        for modality in self.modalities:
            if modality not in MODALITIES:
                raise InputError(f"modality={modality!r} is unknown; give {_one_of(MODALITIES)}")
        if not (1 <= self.height <= 4096 and 1 <= self.width <= 4096):
            raise InputError(f"view of {self.height}x{self.width} pixels; give 1 to 4096 each way")

    def check_modalities(self, renderer: object, supported: Container[str]) -> None:
        """Raise an `InputError` if a renderer does not support all modalities of this view."""
        for modality in self.modalities:
            if modality not in supported:
                names = ", ".join(name for name in MODALITIES if name in supported)
                raise InputError(
                    f"modality={modality!r} can't be rendered by {type(renderer).__name__}; "
                    f"give one of: {names}"
                )

    def new_images(
        self, num_envs: int, device: torch.device | str = "cpu"
    ) -> dict[Modality, Tensor]:
        """Allocate uninitialized images; see `Renderer.render` for their shapes."""
        size = (num_envs, len(self.cameras), self.height, self.width)
        return {
            modality: torch.empty((*size, *pixel), dtype=dtype, device=device)
            for modality in self.modalities
            for dtype, pixel in [_KINDS[modality]]
        }


def to_gray(rgb: Tensor) -> Tensor:
    """Convert RGB bytes to gray in [0, 1]. Shapes: (*, 3), uint8, to (*), float32.

    Each sum is rounded as the kernels round it: gray is the same on every machine.
    """
    red, green, blue = rgb.unbind(-1)
    two = (red * WEIGHTS[0]).double() + green.double() * WEIGHTS[1]
    return (two.float().double() + (blue * WEIGHTS[2]).double()).float()


def _one_of(names: tuple[str, ...]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}"
