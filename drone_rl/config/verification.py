"""Settings of verification: proof, certificate check, success probabilities, decision map."""

import dataclasses
from typing import Annotated

from drone_rl.config import RendererName
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Whole
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


@dataclasses.dataclass(frozen=True, kw_only=True)
class ProvableSettings(Settings):
    """How a policy is trained until it is proved."""

    rounds: Annotated[int, Whole(0, unit="rounds")] = 0
    """Rounds of practice at most, each between two searches for failures; 0 proves nothing."""
    frames: Annotated[int, Whole(1, unit="frames")] = 50_000
    """That are collected in a round."""
    share: Annotated[float, Real(0.0, 1.0)] = 0.5
    """Of a round's episodes that begin where the policy failed; the others begin anywhere."""
    margin: Annotated[float, Real(0.0, 1_000.0, unit="m")] = 0.2
    """Metres by which practice reaches beyond the places of a failure, to either side."""
    flights: Annotated[int, Whole(0, unit="flights")] = 5_000
    """Greedy flights in which failures are looked for first; if there are any, no proof is made."""
    enough: Annotated[int, Whole(1, unit="failures")] = 50
    """Failures after which the search by flights ends."""
    most_boxes: Annotated[int, Whole(1, unit="boxes")] = 20_000
    """Places of failures that a round practises at most: of a proof the largest boxes."""
    limit_s: Annotated[float, Real(0.0, unit="s")] | None = None
    """Seconds after which a proof stops and its failures so far are practised; none for never."""
