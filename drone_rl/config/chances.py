"""What the exact chances of a policy that draws its moves can be told."""

import dataclasses
from typing import Annotated

from drone_rl.config import RendererName
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class ChanceSettings(Settings):
    """Which placements of the cubes are looked at, and where."""

    placements: Annotated[int, Whole(1, unit="placements")] = 100
    """Held-out placements: those of the first episodes of as many worlds of a verdict."""
    seed: Annotated[int, Whole(0)] | None = None
    """Root of the held-out placements' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    within: Annotated[float, Real(0.0, 10_000.0, unit="m")] = 0.0
    """Metres to either side of each cube; if given, success is bounded wherever they stand."""
    parts: Annotated[int, Whole(1, 1_000_000, "parts")] = 20
    """Into which such a box is cut: the more, the closer the bounds, and the longer it takes."""
    device: str = "cpu"
    """Where cells are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
