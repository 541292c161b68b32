"""Settings of verification: proof, certificate check, success probabilities, decision map."""

from typing import Annotated

from drone_rl.config.camera import OnDevice, Rendered
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings


class CheckSettings(OnDevice):
    """Settings of a certificate check."""

    flights: Annotated[int, Whole(1, 10_000_000, "rollouts")] = 2000
    """Rollouts from corners, centres, random points and borders of the boxes."""
    seed: Annotated[int, Whole(0)] | None = None
    """Seed of the rollouts' placements; null takes a fresh one from the operating system, which is
    printed and recorded."""


class ChanceSettings(OnDevice):
    """Settings of exact success probabilities under sampled actions."""

    placements: Annotated[int, Whole(1, unit="placements")] = 100
    """Held-out placements: those of the first episodes of a verdict."""
    seed: Annotated[int, Whole(0)] | None = None
    """Seed of the held-out placements; null takes a fresh one from the operating system, which is
    printed and recorded."""
    within: Annotated[float, Real(0.0, 10_000.0, unit="m")] = 0.0
    """Metres to either side of each cube within which success is bounded; 0 for none."""
    parts: Annotated[int, Whole(1, 1_000_000, "parts")] = 20
    """Cells of such a box: more cells give tighter bounds and take longer."""


class ProveSettings(Rendered):
    """Settings of a proof."""

    logit_gap: Annotated[float, Real(0.0, 1.0)] = 1e-4
    """Logits closer than this count as equal because sums are rounded."""
    compared: Annotated[int, Whole(1, 10_000_000, "images")] = 4_000
    """Random images for which renderer and closed form must agree before the proof begins."""
    limit_s: Annotated[float, Real(0.0, unit="s")] | None = None
    """Seconds after which the proof stops and can be resumed; none for no limit."""
    save_interval_s: Annotated[float, Real(0.0, unit="s")] = 30.0
    """Seconds between saved states, from which a killed proof resumes."""
    most_boxes: Annotated[int, Whole(1, unit="boxes")] = 2_000_000
    """Open boxes at which the proof stops; bounds memory."""
    most_combinations: Annotated[int, Whole(1)] = 500_000_000
    """Cached combinations of images; proofs of more cubes are split into parts."""


class PlacesSettings(Rendered):
    """Settings of the decision map over the positions of one cube."""

    nearest: Annotated[float, Real(0.0, 1000.0, unit="m")] = 2.5
    """Metres from the camera to the centre of a cube, straight ahead, at least."""
    farthest: Annotated[float, Real(0.0, 1000.0, unit="m")] = 20.0
    """Metres from the camera to the centre of a cube, straight ahead, at most."""
    sideways: Annotated[float, Real(0.001, 1000.0, unit="m")] = 8.0
    """Metres to the left or right of the camera, at most."""
    logit_gap: Annotated[float, Real(0.0, 1.0)] = 1e-4
    """Logits closer than this count as equal because sums are rounded."""
    compared: Annotated[int, Whole(1, 10_000_000, "images")] = 4_000
    """Random images for which renderer and closed form must agree before results are claimed."""
    most_cells: Annotated[int, Whole(1, unit="images")] = 1_000_000
    """Distinct images of one cube at which the map stops; bounds memory."""

    def check(self) -> None:
        """Refuses a window without places."""
        if self.nearest >= self.farthest:
            raise InputError(
                f"nearest={self.nearest} leaves no place before farthest={self.farthest}; give less"
            )


class ProvableSettings(Settings):
    """Settings of training until a proof succeeds."""

    rounds: Annotated[int, Whole(0, unit="rounds")] = 0
    """Most rounds of failure replay, each between two searches for failures; 0 disables proofs."""
    frames: Annotated[int, Whole(1, unit="frames")] = 50_000
    """Frames that a round collects."""
    share: Annotated[float, Real(0.0, 1.0)] = 0.5
    """Fraction of a round's episodes that begin at failures; the others begin anywhere."""
    margin: Annotated[float, Real(0.0, 1_000.0, unit="m")] = 0.2
    """Metres by which replayed placements extend beyond a failure, to either side."""
    flights: Annotated[int, Whole(0, unit="rollouts")] = 5_000
    """Greedy rollouts that search for failures before each proof; a failure skips the proof."""
    enough: Annotated[int, Whole(1, unit="failures")] = 50
    """Failures after which the search by rollouts ends."""
    most_boxes: Annotated[int, Whole(1, unit="boxes")] = 20_000
    """Most failures that a round replays: the largest boxes of a proof."""
    limit_s: Annotated[float, Real(0.0, unit="s")] | None = None
    """Seconds after which a proof stops and its failures so far are replayed; none for no limit."""
