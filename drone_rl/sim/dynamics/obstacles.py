"""What drones may touch besides the ground."""

import dataclasses

from torch import Tensor


@dataclasses.dataclass(frozen=True)
class Obstacles:
    """Boxes along the world's axes, in every world as many and all of one size. Metres."""

    centers: Tensor  # (num_worlds, K, 3) float64
    """Their middles; far below the ground where one is absent."""
    half_sizes: tuple[float, float, float]
    """Half their edges."""
