"""Settings of a training."""

import dataclasses
import re
from typing import Annotated, Any, ClassVar, Self

from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
    RendererName,
    TaskSettings,
)
from drone_rl.config.appearance import check_appearance
from drone_rl.config.configuration import Variant
from drone_rl.config.learning import (
    Adam,
    Collector,
    Constant,
    Gae,
    LeaveOneOut,
    Objective,
    Optimiser,
    Reinforce,
    Returns,
    Rollouts,
    Scheduler,
    Threads,
)
from drone_rl.config.networks import Network, SmallCnn
from drone_rl.config.transforms import Gray, Standardize, Transform
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance, Real, Several, Whole
from drone_rl.utils.settings import Settings

MOST_TRANSFORMS = 16


@dataclasses.dataclass(frozen=True, kw_only=True)
class TrainerSettings(Settings):
    """How long to train and when to stop."""

    total_frames: Annotated[int, Whole(1, unit="frames")] = 2_000_000
    """Stop once this many frames were collected."""
    total_episodes: Annotated[int, Whole(1, unit="episodes")] | None = None
    """Stop once this many episodes were collected; none for no limit."""
    target_share: Annotated[float, Real(0.0, 1.0, is_above=True)] | None = 0.99
    """Stop once the running mean reaches this share of the greatest reward; none for never."""
    confirm_episodes: Annotated[int, Whole(0, unit="episodes")] = 200
    """Flights by the most probable actions, in other worlds, that must confirm a policy which has
    reached the target before training stops; 0 for none."""
    confirm_share: Annotated[float, Real(0.0, 1.0)] = 1.0
    """Share of them that must reach every goal."""
    running_decay: Annotated[float, Real(0.0, 1.0, is_below=True)] = 0.99
    """Weight of the old value in the running mean, per episode: 0.99 looks back about 100."""
    max_grad_norm: Annotated[float, Real(0.0, is_above=True)] | None = None
    """Clip the gradient to this norm; none for no clipping."""
    minibatch_frames: Annotated[int, Whole(1, unit="frames")] = 1024
    """Frames in one forward and backward pass; bounds memory. Sums are rounded by it."""
    compiled: bool = True
    """Whether a compiled kernel works out gradients, where it knows the network: sooner than
    torch on a CPU. It adds in another order, so this is part of what a seed means."""
    num_threads: Annotated[int, Whole(1, unit="threads")] = 2
    """Threads that learn, wherever this runs; sums depend on how many there are."""
    checkpoint_interval_s: Annotated[float, Real(0.0, unit="s")] = 15.0
    """Seconds between two checkpoints."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class TrainSettings(Settings):
    """One training: what is learned, how, and for how long."""

    task: BaseTaskSettings = TaskSettings()
    """What the drone has to do."""
    appearance: AppearanceSettings = AppearanceSettings()
    """How its worlds look."""
    dynamics: DynamicsSettings = DynamicsSettings()
    """How it moves."""
    actions: ActionSettings = ActionSettings()
    """What the policy can ask for."""
    camera: CameraSettings = CameraSettings()
    """The picture that the drone takes."""
    transforms: Annotated[
        tuple[Transform, ...], Several(Instance(Transform), 0, MOST_TRANSFORMS)
    ] = (Gray(), Standardize())
    """What becomes of the picture, in this order."""
    network: Network = SmallCnn()
    """From picture to logits."""
    returns: Returns = LeaveOneOut()
    """What a step is worth."""
    objective: Objective = Reinforce()
    """What is made smaller, and what learns."""
    optimiser: Optimiser = Adam()
    """How."""
    scheduler: Scheduler = Constant()
    """The course of the learning rate."""
    collector: Collector = Threads()
    """Where batches come from."""
    trainer: TrainerSettings = TrainerSettings()
    """How long, and when to stop."""
    seed: Annotated[int, Whole(0)] = 0
    """Root of every random stream: worlds, actions, initial weights."""
    device: str = "cpu"
    """Where worlds are drawn and policies run: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
    evaluate_after: Annotated[int, Whole(0, unit="episodes")] = 0
    """Episodes, in worlds to choose by, of the verdict at the end; 0 for none."""

    def check(self) -> None:
        """Refuses parts that can't work together."""
        if self.renderer != "raytrace" and not self.appearance.is_minimal:
            raise InputError(
                f"renderer={self.renderer} draws the minimal appearance alone; give "
                "renderer=raytrace or appearance=minimal"
            )
        self.dynamics.check_air()
        check_appearance(self.appearance, self.camera, self.task.things, self.task.name)
        needs, objective = self.objective.needs, self.objective.name
        for name, part in needs.items():
            given = getattr(self, name)
            if given.is_known and not isinstance(given, type(part)):
                raise InputError(
                    f"objective={objective} does not go with these settings of {name}; give "
                    f"{name}={part.name}"
                )
        for name, kind in {"returns": Gae, "collector": Rollouts}.items():
            part = getattr(self, name)
            if isinstance(part, kind) and name not in needs:
                raise InputError(
                    f"{name}={part.name} is for a critic, which objective={objective} lacks; give "
                    f"objective=ppo or a2c, or another {name}"
                )

    def replace(self, **changes: Any) -> Self:
        """See `Settings`; a new objective brings the parts that it needs, unless they are given."""
        objective = changes.get("objective")
        if isinstance(objective, Objective):
            for name, part in objective.needs.items():
                if not isinstance(getattr(self, name), type(part)):
                    changes.setdefault(name, part)
        return super().replace(**changes)


_NEEDS = re.compile(r"([a-z][\w.-]*) (?:could not be imported|is not installed|is required)")
"""What TorchRL's loggers say of a package that they miss."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Logger(Variant):
    """Which of TorchRL's loggers, and with which values."""

    def make(self, *args: Any, **kwargs: Any) -> Any:
        """Make the logger.

        Raises:
            InputError: It doesn't exist, or the package that it needs is not installed.
        """
        try:
            return super().make(*args, **kwargs)
        except ImportError as error:  # TorchRL raises it without the name of the package
            words = _NEEDS.match(str(error).lower())
            package = (error.name or (words and words[1]) or "").partition(".")[0]
            remedy = f"pip install {package}" if package else "pip install with what it needs"
            raise InputError(
                f"logger _target_={self.target} can't be made ({error}); install what it needs: "
                f"{remedy}, or choose another logger"
            ) from error


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tensorboard(Logger):
    """TensorBoard event files."""

    target: ClassVar[str] = "torchrl.record.loggers.tensorboard.TensorboardLogger"
    exp_name: str = "tensorboard"
    """Folder of this logger under log_dir."""
    log_dir: str = "outputs"
    """Where the logs go."""
