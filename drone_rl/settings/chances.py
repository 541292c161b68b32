"""What the exact chances of a policy that draws its moves can be told."""

import dataclasses
from typing import Annotated

from drone_rl.utils.schema import Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class ChanceSettings(Settings):
    """Which placements of the cubes are looked at, and where."""

    placements: Annotated[int, Whole(1)] = 100
    """Held-out placements: those of the first episodes of as many worlds of a verdict."""
    seed: Annotated[int, Whole(0)] = 0
    """Root of the held-out worlds' random streams; training never draws from these."""
    device: str = "cpu"
    """Where cells are drawn and the policy runs: cpu, cuda or cuda:N."""
