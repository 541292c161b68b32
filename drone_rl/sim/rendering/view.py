"""What is asked of a renderer: which camera, how large, and what of it."""

import dataclasses
from collections.abc import Container
from typing import Literal, get_args

import torch
from torch import Tensor

from drone_rl.utils.errors import InputError

Modality = Literal["rgb", "depth", "segmentation"]
"""What a pixel says: colour, distance or the geom that is there."""
MODALITIES: tuple[Modality, ...] = get_args(Modality)
_DTYPES = {"rgb": torch.uint8, "depth": torch.float32, "segmentation": torch.int32}


@dataclasses.dataclass(frozen=True, kw_only=True)
class View:
    """One camera's picture of every world.

    Raises:
        InputError: The size is out of range or the modality unknown.
    """

    camera: str
    """Full name of the camera in the model, such as "drone/front_center"."""
    height: int
    width: int
    modality: Modality = "rgb"
    show_drone: bool = False
    """Whether the drone's own body is drawn; its own cameras leave it out."""

    def __post_init__(self) -> None:
        """Refuses what can't be drawn."""
        if self.modality not in MODALITIES:
            raise InputError(
                f"modality={self.modality!r} is unknown; give rgb, depth or segmentation"
            )
        if not (1 <= self.height <= 4096 and 1 <= self.width <= 4096):
            raise InputError(f"view of {self.height}x{self.width} pixels; give 1 to 4096 each way")

    def check_modality(self, renderer: object, drawn: Container[str]) -> None:
        """Refuses a view that a renderer does not know.

        Args:
            renderer: The renderer.
            drawn: Modalities that it knows.

        Raises:
            InputError: This one's is none of them.
        """
        if self.modality not in drawn:
            known = ", ".join(name for name in MODALITIES if name in drawn)
            raise InputError(
                f"view {self.modality!r} can't be drawn by {type(renderer).__name__}; "
                f"ask for one of: {known}"
            )

    def new_pictures(self, num_worlds: int, device: torch.device | str = "cpu") -> Tensor:
        """Pictures to be drawn into; see `Renderer.render` for their shapes."""
        shape = (num_worlds, self.height, self.width, *([3] if self.modality == "rgb" else []))
        return torch.empty(shape, dtype=_DTYPES[self.modality], device=device)
