"""Settings of commands: evaluation, verdict, robustness, verification, benchmarks, Gymnasium."""

from typing import Annotated, Any, Literal, get_args

from drone_rl.config import ActionSettings, CameraSettings, DynamicsSettings
from drone_rl.config.camera import DeviceSettings, RendererSettings
from drone_rl.config.inputs import Inputs
from drone_rl.config.parts import Parts
from drone_rl.config.transforms import MOST_TRANSFORMS, Transform
from drone_rl.config.values import Fraction, NumEnvs, NumEpisodes, OpenFraction, Seed
from drone_rl.utils.schema import Listed, OneOf, Real, Several, Whole
from drone_rl.utils.settings import Settings


class HeldOutSettings(DeviceSettings):
    """Settings of held-out episodes."""

    episodes: NumEpisodes = 1000
    """Held-out episodes, each in its own scene; all policies get the same scenes."""
    seed: Seed | None = None
    """Root of the held-out environments' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    num_envs: NumEnvs = 250
    """Environments in a batch; bounds memory."""

    @property
    def batch_size(self) -> int:
        """Environments in a batch, at most as many as episodes."""
        return min(self.num_envs, self.episodes)


class EvaluateSettings(HeldOutSettings):
    """Settings of an evaluation."""

    baselines: bool = True
    """Evaluate the random and constant baselines and the oracle, too."""


class JudgeSettings(HeldOutSettings):
    """Settings of a verdict."""

    episodes: NumEpisodes = 400
    """Held-out episodes of the greedy and the sampled policy, the baselines and the oracle."""
    num_envs: NumEnvs = 400
    sampled: bool = True
    """Evaluate the policy with sampled actions, too; reported next to the verdict."""
    good_share: OpenFraction = 0.9
    """Fraction of the oracle's success rate that a good policy exceeds."""
    certificate_flights: Annotated[int, Whole(0, 10_000_000, "rollouts")] = 3000
    """Episodes that check a certificate like drone-rl check; they can refute it, not prove it."""
    domain_flights: Annotated[int, Whole(0, 100_000, "episodes")] = 200
    """New episodes at strengths drawn from all required ranges together, one each; with 0 the
    required domain is not covered."""


BODIES = (
    "computer vision",
    "simple flight",
    "wind 2 m/s",
    "wind 5 m/s",
    "wind 8 m/s",
    "motors twice as slow",
    "camera on the body",
)
"""Dynamics in which policies are tested, in this order."""


class BodiesSettings(JudgeSettings):
    """Settings of a dynamics sweep: policies and dynamics."""

    policies: Annotated[tuple[str, ...], Listed("policy", most=64)] = ("good", "proved")
    """Policies: files, folders of runs, latest, or names of shipped policies."""
    bodies: Annotated[tuple[str, ...], Several(OneOf(BODIES), 1, len(BODIES))] = BODIES
    """Dynamics to test."""
    episodes: NumEpisodes = 400
    """Held-out greedy episodes of each policy under each dynamics; all get the same scenes."""
    num_envs: NumEnvs = 400
    sampled: bool = False
    """Evaluate with sampled actions, too."""
    certificate_flights: Annotated[int, Whole(0, 10_000_000, "rollouts")] = 0
    """Episodes that check a certificate; with 0 it is quoted as not checked."""
    domain_flights: Annotated[int, Whole(0, 100_000, "episodes")] = 0
    """New episodes that check a required operating domain; the table requires none."""
    loop_flights: Annotated[int, Whole(0, 1000, "rollouts")] = 0
    """Real-time rollouts of each policy with Betaflight in the loop; 0 for none."""

    def check(self) -> None:
        """Refuse duplicate bodies."""
        super().check()
        if len({*self.bodies}) < len(self.bodies):
            self.refuse("bodies", "has one twice; give each once")


Mode = Literal["constant", "drifting", "onset"]
"""When a perturbation is active: constant, from start to end, in each environment with one of the
extreme variations; drifting, in each a random walk of the variation that begins at 0; onset, as
constant, but only from a step on."""
MODES: tuple[Mode, ...] = get_args(Mode)


class ShiftSettings(DeviceSettings):
    """Settings of robustness tests."""

    axes: Annotated[Any, Listed("axis")] | None = None
    """Axes or groups of axes, as in axes=[sun,fog]; null for all that the task has."""
    strengths: Annotated[tuple[int, ...], Several(Whole(1, 5), 1, 5)] = (1, 2, 3, 4, 5)
    """Strengths to test of the five of each axis, in rising order."""
    modes: Annotated[tuple[Mode, ...], Several(OneOf(MODES), 1, 3)] = MODES
    """Time course of a perturbation: constant, drifting, or from an onset."""
    domain: bool = True
    """Search for the widest range of each axis in which the policy stays good."""
    episodes: Annotated[int, Whole(1, 100_000, "episodes")] = 200
    """Episodes under each perturbation, each in its own scene; all get the same scenes."""
    domain_episodes: Annotated[int, Whole(1, 100_000, "episodes")] = 400
    """Episodes at each strength of the search for the range: more episodes make it wider."""
    seed: Seed | None = None
    """Root of the held-out environments' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    good_share: OpenFraction = 0.9
    """Fraction of the oracle's success rate that a good policy exceeds."""
    possible_share: OpenFraction = 0.9
    """A strength is impossible if the oracle's success rate is certainly below this."""

    def check(self) -> None:
        """Refuse strengths that don't rise, duplicate modes, and modes without the constant one."""
        if [*self.strengths] != sorted({*self.strengths}):
            self.refuse("strengths", "don't rise; give each once, in order")
        if len({*self.modes}) < len(self.modes):
            self.refuse("modes", "has one twice; give each once")
        if MODES[0] not in self.modes:
            self.refuse("modes", "leaves out constant, the reference of all others; add it")


class GymnasiumSettings(DeviceSettings):
    """Options of `gymnasium.make`; no command has them, so that no file of conf/ does."""

    observations: Literal["pixels", "state"] = "pixels"
    """Observations: the camera's image or the state vector."""
    camera: CameraSettings = CameraSettings()
    """Camera of the policy."""
    transforms: Annotated[tuple[Transform, ...], Parts(Transform, MOST_TRANSFORMS)] = ()
    """From the camera's image to the observation; by default it stays as it is."""
    inputs: Inputs | None = None
    """Inputs by name, instead of camera and transforms: observations are a dictionary of them."""
    dynamics: DynamicsSettings = DynamicsSettings()
    """Vehicle dynamics."""
    actions: ActionSettings = ActionSettings()
    """Actions of the policy."""
    render_mode: Literal["rgb_array"] | None = None
    """Return value of `render`: None, or rgb_array for images of the drone from behind."""


class BenchSettings(Settings):
    """Settings of the benchmarks."""

    only: Annotated[tuple[str, ...], Listed("benchmark")] | None = None
    """Names of benchmarks or of groups of them; null for all without a result of this revision."""
    quick: bool = False
    """Run a short version of each benchmark with rough results."""
    seeds: Annotated[tuple[int, ...], Several(Whole(0), 1, 1000)] = (0, 1, 2, 3, 4)
    """Seeds of the timed trainings."""
    episodes: NumEpisodes = 1000
    """Held-out episodes of each trained policy."""
    num_envs: NumEnvs = 512
    """Environments in a batch of the speed benchmarks."""
    memory_frames: Annotated[int, Whole(1, unit="frames")] = 1_000_000
    """Frames over which memory must stay constant."""
    device: str = "cpu"
    """Device of renderer and policies: cpu, cuda or cuda:N."""
    folder: str = "outputs/bench"
    """Folder of results.json and the plots."""


class PathsSettings(Settings):
    """Folders."""

    outputs: str = "outputs"
    """Folder under which each command creates its own folder."""


class CheckSettings(DeviceSettings):
    """Settings of a certificate check."""

    flights: Annotated[int, Whole(1, 10_000_000, "rollouts")] = 3000
    """Episodes from random placements, boxes, borders, and limits of all placements."""
    seed: Seed | None = None
    """Seed of the rollouts' placements; null takes a fresh one from the operating system, which is
    printed and recorded."""


class ChanceSettings(DeviceSettings):
    """Settings of exact success probabilities under sampled actions."""

    placements: Annotated[int, Whole(1, unit="placements")] = 100
    """Held-out placements: those of the first episodes of a verdict."""
    seed: Seed | None = None
    """Seed of the held-out placements; null takes a fresh one from the operating system, which is
    printed and recorded."""


class ProveSettings(RendererSettings):
    """Settings of a proof."""

    logit_gap: Fraction = 1e-4
    """Logits closer than this count as equal because sums are rounded."""
    compared: Annotated[int, Whole(1, 10_000_000, "images")] = 4_000
    """Random images for which renderer and closed form must agree before the proof begins."""
    limit_s: Annotated[float, Real(0.0, unit="s")] | None = None
    """Seconds after which the proof stops and can be resumed; null for no limit."""
    save_interval_s: Annotated[float, Real(0.0, unit="s")] = 30.0
    """Seconds between saved states, from which a killed proof resumes."""
    most_boxes: Annotated[int, Whole(1, unit="boxes")] = 2_000_000
    """Open boxes at which the proof stops; bounds memory."""
    most_combinations: Annotated[int, Whole(1)] = 500_000_000
    """Maximum number of combinations of cube images per part; proofs of more are split."""


class PlacesSettings(RendererSettings):
    """Settings of the decision map over the positions of one cube."""

    nearest: Annotated[float, Real(0.0, 1000.0, unit="m")] = 2.5
    """Metres from the camera to the centre of a cube, straight ahead, at least."""
    farthest: Annotated[float, Real(0.0, 1000.0, unit="m")] = 20.0
    """Metres from the camera to the centre of a cube, straight ahead, at most."""
    sideways: Annotated[float, Real(0.001, 1000.0, unit="m")] = 8.0
    """Metres to the left or right of the camera, at most."""
    logit_gap: Fraction = 1e-4
    """Logits closer than this count as equal because sums are rounded."""
    compared: Annotated[int, Whole(1, 10_000_000, "images")] = 4_000
    """Random images for which renderer and closed form must agree before results are claimed."""
    most_cells: Annotated[int, Whole(1, unit="images")] = 1_000_000
    """Distinct images of one cube at which the map stops; bounds memory."""

    def check(self) -> None:
        """Refuse a window without places."""
        if self.nearest >= self.farthest:
            self.refuse("nearest", f"leaves no place before farthest={self.farthest}; give less")


class ProvableSettings(Settings):
    """Settings of training until a proof succeeds."""

    rounds: Annotated[int, Whole(0, unit="rounds")] = 0
    """Most rounds of failure replay, each between two searches for failures; 0 disables proofs."""
    frames: Annotated[int, Whole(1, unit="frames")] = 50_000
    """Frames that a round collects."""
    share: Fraction = 0.5
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
    """Seconds after which a proof stops and its failures so far are replayed; null for no limit."""
