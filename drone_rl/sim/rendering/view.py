"""What is asked of a renderer: which camera, how large, and what of it."""

import dataclasses
from typing import Literal, get_args

from drone_rl.utils.errors import InputError

Modality = Literal["rgb", "depth", "segmentation"]
"""What a pixel says: colour, distance or the geom that is there."""
MODALITIES: tuple[Modality, ...] = get_args(Modality)


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
