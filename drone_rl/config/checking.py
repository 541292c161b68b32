"""What the check of a certificate can be told."""

import dataclasses
from typing import Annotated

from drone_rl.config import RendererName
from drone_rl.utils.schema import Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class CheckSettings(Settings):
    """How a certificate is checked."""

    flights: Annotated[int, Whole(1, 10_000_000, "flights")] = 2000
    """Flights from corners, centres and random points of the boxes, and beside their borders."""
    seed: Annotated[int, Whole(0)] | None = None
    """Root of the random stream from which the flights' placements are drawn; null takes a fresh
    one from the operating system, which is printed and recorded."""
    device: str = "cpu"
    """Where worlds are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
