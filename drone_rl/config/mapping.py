"""What the exact map of a policy's places can be told."""

import dataclasses
from typing import Annotated

from drone_rl.config import RendererName
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class PlacesSettings(Settings):
    """Which places of one cube are looked at, and how.

    Raises:
        InputError: A value is out of range, or the least distance is not the lesser one.
    """

    nearest: Annotated[float, Real(0.0, 1000.0, unit="m")] = 2.5
    """Metres from the camera to the centre of a cube, straight ahead, at least."""
    farthest: Annotated[float, Real(0.0, 1000.0, unit="m")] = 20.0
    """The same at most."""
    sideways: Annotated[float, Real(0.001, 1000.0, unit="m")] = 8.0
    """Metres to the left or right, at most."""
    logit_gap: Annotated[float, Real(0.0, 1.0)] = 1e-4
    """Where the two highest logits are closer, either action may be taken: sums are not exact."""
    compared: Annotated[int, Whole(1, 10_000_000, "pictures")] = 4_000
    """Random pictures of the renderer that must be the closed form's before anything is claimed."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
    most_cells: Annotated[int, Whole(1, unit="pictures")] = 1_000_000
    """Different pictures of one cube after which a camera or a window is too large; bounds
    memory."""

    def check(self) -> None:
        """Refuses a window without places."""
        if self.nearest >= self.farthest:
            raise InputError(
                f"nearest={self.nearest} leaves no place before farthest={self.farthest}; give less"
            )
