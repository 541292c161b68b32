"""What a proof can be told."""

import dataclasses
from typing import Annotated

from drone_rl.config import RendererName
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class ProveSettings(Settings):
    """How a proof is made."""

    logit_gap: Annotated[float, Real(0.0, 1.0)] = 1e-4
    """Where the two highest logits are closer, either action may be taken: sums are not exact."""
    compared: Annotated[int, Whole(1, 10_000_000, "pictures")] = 4_000
    """Random pictures of the renderer that must be the closed form's before the proof begins."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
    limit_s: Annotated[float, Real(0.0, unit="s")] | None = None
    """Seconds after which the proof stops, to be gone on with; none for never."""
    save_interval_s: Annotated[float, Real(0.0, unit="s")] = 30.0
    """Seconds between two states on disk, from which a proof that was killed goes on."""
    most_boxes: Annotated[int, Whole(1, unit="boxes")] = 2_000_000
    """Boxes under way after which the proof stops: they bound its memory."""
    most_combinations: Annotated[int, Whole(1)] = 500_000_000
    """Of pictures that are remembered at a time; where cubes have more, proofs go part by part."""
