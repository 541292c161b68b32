"""What is asked of a renderer: which cameras, how large, and what of it."""

import dataclasses
from collections.abc import Container
from typing import Literal, get_args

import torch
from torch import Tensor

from drone_rl.utils.errors import InputError

Modality = Literal["rgb", "gray", "depth", "distance", "segmentation", "normals"]
"""What a pixel says: colour, brightness, how far away (along the camera's axis, along the pixel's
own ray), which geom, which way its surface looks."""
MODALITIES: tuple[Modality, ...] = get_args(Modality)
_KINDS: dict[Modality, tuple[torch.dtype, tuple[int, ...]]] = {
    "rgb": (torch.uint8, (3,)),
    "gray": (torch.float32, ()),
    "depth": (torch.float32, ()),
    "distance": (torch.float32, ()),
    "segmentation": (torch.int32, ()),
    "normals": (torch.float32, (3,)),
}
"""Type and shape of a pixel."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class View:
    """Pictures of every world: what each of some cameras shows, all of one size.

    Raises:
        InputError: The size is out of range, nothing is asked for, or a modality is unknown.
    """

    cameras: tuple[str, ...]
    """Full names of cameras in the model, such as "drone/front_center"."""
    height: int
    width: int
    modalities: tuple[Modality, ...] = ("rgb",)
    show_drone: bool = False
    """Whether the drone's own body is drawn; its own cameras leave it out."""

    def __post_init__(self) -> None:
        """Refuses what can't be drawn."""
        if not self.cameras:
            raise InputError("cameras=() shows nothing; name a camera or more")
        if not self.modalities:
            raise InputError(f"modalities=() shows nothing; give {_one_of(MODALITIES)}")
        for modality in self.modalities:
            if modality not in MODALITIES:
                raise InputError(f"modality={modality!r} is unknown; give {_one_of(MODALITIES)}")
        if not (1 <= self.height <= 4096 and 1 <= self.width <= 4096):
            raise InputError(f"view of {self.height}x{self.width} pixels; give 1 to 4096 each way")

    def check_modalities(self, renderer: object, drawn: Container[str]) -> None:
        """Refuses a view that a renderer does not know.

        Args:
            renderer: The renderer.
            drawn: Modalities that it knows.

        Raises:
            InputError: One of this one's is none of them.
        """
        for modality in self.modalities:
            if modality not in drawn:
                known = ", ".join(name for name in MODALITIES if name in drawn)
                raise InputError(
                    f"view {modality!r} can't be drawn by {type(renderer).__name__}; "
                    f"ask for one of: {known}"
                )

    def new_pictures(
        self, num_worlds: int, device: torch.device | str = "cpu"
    ) -> dict[Modality, Tensor]:
        """Pictures to be drawn into; see `Renderer.render` for their shapes."""
        size = (num_worlds, len(self.cameras), self.height, self.width)
        pictures: dict[Modality, Tensor] = {}
        for modality in self.modalities:
            dtype, pixel = _KINDS[modality]
            pictures[modality] = torch.empty((*size, *pixel), dtype=dtype, device=device)
        return pictures


def _one_of(names: tuple[str, ...]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}"


LUMA = (0.299, 0.587, 0.114)
"""Weights of red, green and blue in a gray pixel (ITU-R BT.601), as in the original study."""
WEIGHTS = tuple((torch.tensor(LUMA) / 255.0).tolist())
"""The same for bytes, rounded to float32, so that gray is from 0 to 1."""


def to_gray(rgb: Tensor) -> Tensor:
    """RGB bytes to gray from 0 to 1. Shapes: (*, 3), uint8, to (*), float32.

    Each sum is rounded as kernels round it, so that gray is the same on every machine: a product of
    matrices would be rounded as its library likes.
    """
    red, green, blue = rgb.unbind(-1)
    two = (red * WEIGHTS[0]).double() + green.double() * WEIGHTS[1]
    return (two.float().double() + (blue * WEIGHTS[2]).double()).float()
