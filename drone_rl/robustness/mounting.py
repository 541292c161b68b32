"""The camera mounted elsewhere on the drone, or turned there."""

import dataclasses

from torch import Tensor

from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.appearance import moved, turned


@dataclasses.dataclass(frozen=True)
class Mount:
    """A camera that is moved, and turned about itself."""

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Metres, drone frame: forward, to the left, up."""
    turn: str = "yaw"
    """Around which axis of the drone, see `drone_rl.sim.rendering.appearance.AXES`."""
    degrees: float = 0.0
    dimensions: int = 1
    """One number: 1 as stated, -1 the opposite way."""

    def __call__(self, appearance: Appearance | None, sway: Tensor) -> Appearance:
        """The same look through the camera so mounted.

        Args:
            appearance: As in the model by default.
            sway: How much of it, from -1 to 1. Shape: (num_worlds, 1).
        """
        appearance = appearance or Appearance()
        offset = sway * sway.new_tensor(self.offset)
        turn = turned(self.turn, sway[:, 0] * self.degrees).to(sway)
        camera = moved(appearance.camera, offset, turn)
        return dataclasses.replace(appearance, camera=camera)
