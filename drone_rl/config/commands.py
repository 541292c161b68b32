"""Settings of commands: evaluation, verdict, robustness, dynamics sweep, benchmarks, Gymnasium."""

import dataclasses
from typing import Annotated, Any

from drone_rl.config import ActionSettings, CameraSettings, DynamicsSettings, RendererName
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Listed, Maybe, OneOf, Real, Several, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class FlightSettings(Settings):
    """How many episodes are flown, in which worlds, and where."""

    episodes: Annotated[int, Whole(1, unit="episodes")] = 1000
    """Held-out episodes, each in a world of its own; the same worlds for all that is flown."""
    seed: Annotated[int, Whole(0)] | None = None
    """Root of the held-out environments' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 250
    """Worlds in one batch; bounds memory."""
    device: str = "cpu"
    """Where worlds are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""

    @property
    def num_worlds(self) -> int:
        """Worlds in a batch, of which none flies in vain."""
        return min(self.num_envs, self.episodes)


@dataclasses.dataclass(frozen=True, kw_only=True)
class EvaluateSettings(FlightSettings):
    """How a policy is evaluated."""

    baselines: bool = True
    """Whether to evaluate luck (random actions, each action always) and the oracle beside it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class JudgeSettings(FlightSettings):
    """How a policy is judged."""

    episodes: Annotated[int, Whole(1, unit="episodes")] = 400
    """Held-out episodes, flown greedily, with drawn actions and by luck and the oracle alike."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 400
    """Worlds in one batch; bounds memory."""
    sampled: bool = True
    """Whether to fly the policy with drawn actions, too; told beside the verdict."""
    good_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """A good policy succeeds in more than this share of the oracle's episodes."""
    certificate_flights: Annotated[int, Whole(0, 10_000_000, "flights")] = 1000
    """Rollouts that re-check a certificate, as `drone-rl check` does; with 0 it proves nothing."""
    domain_flights: Annotated[int, Whole(0, 100_000, "episodes")] = 200
    """New episodes at each strength of a sample of those of a required domain; with 0 it is not
    covered."""


BODIES = (
    "computer vision",
    "simple flight",
    "wind 2 m/s",
    "wind 5 m/s",
    "wind 8 m/s",
    "motors twice as slow",
    "camera on the body",
)
"""In what policies are flown, in this order."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BodiesSettings(JudgeSettings):
    """Whose verdicts are compared, and in which bodies and airs.

    Raises:
        InputError: A value is out of range, or a policy or body is named twice.
    """

    policies: Annotated[tuple[str, ...], Listed("policy", most=64)] = ("good", "proved")
    """Whom to fly: files, folders of runs, latest, or policies that travel with the package."""
    bodies: Annotated[tuple[str, ...], Several(OneOf(BODIES), 1, len(BODIES))] = BODIES
    """In what."""
    episodes: Annotated[int, Whole(1, unit="episodes")] = 400
    """Held-out episodes of each policy in each body, flown greedily; the same worlds for all."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 400
    """Worlds in one batch; bounds memory."""
    sampled: bool = False
    """Whether to fly with drawn actions, too."""
    certificate_flights: Annotated[int, Whole(0, 10_000_000, "flights")] = 0
    """Rollouts that re-check a certificate; with 0 the table's verdicts prove nothing."""
    domain_flights: Annotated[int, Whole(0, 100_000, "episodes")] = 0
    """New episodes that check a required operating domain; the table requires none."""
    loop_flights: Annotated[int, Whole(0, 1000, "flights")] = 0
    """Of each policy with the firmware Betaflight on board, in real time; 0 for none."""

    def check(self) -> None:
        """Refuses bodies twice."""
        super().check()
        if len({*self.bodies}) < len(self.bodies):
            raise InputError(f"bodies={[*self.bodies]} has one twice; give each once")


MODES = ("constant", "drifting", "onset")


@dataclasses.dataclass(frozen=True, kw_only=True)
class ShiftSettings(Settings):
    """Which conditions a policy is flown under, and how often.

    Raises:
        InputError: A value is out of range, strengths don't rise, or nothing is constant.
    """

    axes: Annotated[Any, Maybe(Listed("axis"))] = None
    """Axes, or groups of them; none for all that the task has."""
    strengths: Annotated[tuple[int, ...], Several(Whole(1, 5), 1, 5)] = (1, 2, 3, 4, 5)
    """Which of the five strengths of each axis, from the weakest on; rising."""
    modes: Annotated[tuple[str, ...], Several(OneOf(MODES), 1, 3)] = MODES
    """When a condition holds: constant, drifting within the strength, or from an onset on."""
    domain: bool = True
    """Whether to search for the widest range of each axis in which the policy stays good."""
    episodes: Annotated[int, Whole(1, 100_000, "episodes")] = 200
    """Flights under each condition, each in a world of its own; the same worlds for all."""
    domain_episodes: Annotated[int, Whole(1, 100_000, "episodes")] = 400
    """The same of each strength at which the range's ends are looked for: more make it wider."""
    seed: Annotated[int, Whole(0)] | None = None
    """Root of the held-out environments' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    good_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """A good policy succeeds in more than this share of the oracle's episodes."""
    possible_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """A strength is impossible if who knows where all is that the camera shows surely succeeds less
    often."""
    device: str = "cpu"
    """Where worlds are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""

    def check(self) -> None:
        """Refuses strengths twice, and what has nothing to be compared with."""
        if [*self.strengths] != sorted({*self.strengths}):
            raise InputError(f"strengths={[*self.strengths]} don't rise; give each once, in order")
        if MODES[0] not in self.modes:
            raise InputError(
                f"modes={[*self.modes]} leaves out constant, with which all others are compared; "
                "add it"
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class GymnasiumSettings(Settings):
    """Options of `gymnasium.make`; no command has them, so that no file of conf/ does."""

    observations: Annotated[str, OneOf(("pixels", "state"))] = "pixels"
    """The camera's frame, or the true state in a vector."""
    camera: CameraSettings = CameraSettings()
    """The picture that the drone takes."""
    dynamics: DynamicsSettings = DynamicsSettings()
    """How it moves."""
    actions: ActionSettings = ActionSettings()
    """What it can be asked for."""
    render_mode: Annotated[str, OneOf(("rgb_array",))] | None = None
    """What `render` returns: none for nothing, rgb_array for the drone from behind."""
    device: str = "cpu"
    """Where worlds are drawn: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BenchSettings(Settings):
    """What is measured, how thoroughly, and where."""

    only: Annotated[tuple[str, ...], Listed("benchmark")] | None = None
    """Which benchmarks to run; none for all that were not run yet with just this code."""
    quick: bool = False
    """A short form of each, for a first look; its figures are rough."""
    seeds: Annotated[tuple[int, ...], Several(Whole(0), 1, 1000)] = (0, 1, 2, 3, 4)
    """Seeds of the trainings that are timed."""
    episodes: Annotated[int, Whole(1, unit="episodes")] = 1000
    """Held-out episodes of each trained policy."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 512
    """Worlds in a batch of the speed benchmarks."""
    memory_frames: Annotated[int, Whole(1, unit="frames")] = 1_000_000
    """Frames over which memory must stay flat."""
    device: str = "cpu"
    """Where worlds are drawn and policies run: cpu, cuda or cuda:N."""
    folder: str = "outputs/bench"
    """Folder of results.json and the plots."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class PathsSettings(Settings):
    """Folders."""

    outputs: str = "outputs"
    """Folder under which every command makes a folder of its own."""
