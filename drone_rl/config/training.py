"""Settings of a training."""

from collections.abc import Mapping
from typing import Annotated, Any, Self, Unpack

import pydantic

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
from drone_rl.config.inputs import DEFAULT_INPUTS, CameraPixels, Inputs
from drone_rl.config.learning import (
    Adam,
    Collector,
    Constant,
    Episodes,
    Gae,
    LearningRate,
    LeaveOneOut,
    Objective,
    Optimizer,
    Reinforce,
    Returns,
    Rollouts,
    Scheduler,
)
from drone_rl.config.networks import Network, SmallCnn
from drone_rl.config.parts import NetworkOptions, Part, Parts
from drone_rl.config.transforms import DEFAULT_TRANSFORMS, MOST_TRANSFORMS, Transform
from drone_rl.config.values import Fraction, NumEpisodes, Seed
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings

DETERMINISTIC = 0.01
"""Entropy in nats below which a policy is practically deterministic."""


class TrainerSettings(Settings):
    """Settings of the training loop: stopping rule, gradients, threads, checkpoints."""

    total_frames: Annotated[int, Whole(0, unit="frames")] = 2_000_000
    """Stop after the batch that reaches this many frames; 0 collects none, to clone only."""
    total_episodes: NumEpisodes | None = None
    """Stop after the batch that reaches this many episodes; null for no limit."""
    target_share: Annotated[float, Real(0.0, 1.0, is_above=True)] | None = 0.99
    """Stop once the running reward reaches this fraction of the task's `largest_reward`; null
    disables this rule. In a task without one, confirmations decide."""
    confirm_episodes: Annotated[int, Whole(0, unit="episodes")] = 200
    """Greedy episodes in other environments that must confirm the policy before `target_share`
    stops the training; 0 skips the confirmation."""
    confirm_share: Fraction = 1.0
    """Fraction of these episodes that must reach every goal."""
    confirm_interval: Annotated[int, Whole(1, unit="updates")] | None = None
    """Updates from one confirmation to the next; null for each that reaches `target_share`, or in a
    task without `largest_reward` after ten times as many episodes."""
    running_decay: Annotated[float, Real(0.0, 1.0, is_below=True)] = 0.99
    """Weight of the old value in the running reward, per episode: 0.99 averages about 100."""
    max_grad_norm: Annotated[float, Real(0.0, is_above=True)] | None = None
    """Clip the gradient to this norm; null for no clipping."""
    chunk_frames: Annotated[int, Whole(1, unit="frames")] = 1024
    """Frames per forward and backward pass. Gradients are accumulated over chunks, so this bounds
    memory and affects only rounding."""
    compiled: bool = True
    """Compute gradients in a fused kernel if it supports the network, which is faster on a CPU.
    It sums in a different order, so results for a seed depend on it."""
    num_threads: Annotated[int, Whole(1, unit="threads")] = 2
    """Threads of PyTorch, for the learner and for policies outside of the fused kernel; results
    depend on their number through rounding."""
    checkpoint_interval_s: Annotated[float, Real(0.0, unit="s")] = 15.0
    """Seconds between two checkpoints."""


class CloningSettings(Settings):
    """Settings of behavior cloning, with which a training with demonstrations begins."""

    epochs: Annotated[int, Whole(1, 100_000, "epochs")] = 30
    """Passes over the demonstrations."""
    lr: LearningRate = 1e-3
    """Learning rate of Adam."""
    minibatch_size: Annotated[int, Whole(1, 1_000_000, "frames")] = 64
    """Frames in a minibatch, each a step of the optimizer."""
    held_out_share: Annotated[float, Real(0.0, 1.0, is_below=True)] = 0.1
    """Fraction of the demonstrations that are not learned from but measure loss and accuracy."""


class TrainSettings(Settings):
    """Settings of a training.

    A mapping without a name has values of the default variant: `optimizer={"lr": 1e-3}` is Adam's.
    """

    task: BaseTaskSettings = TaskSettings()
    """Task."""
    appearance: AppearanceSettings = AppearanceSettings()
    """Appearance of the scenes."""
    dynamics: DynamicsSettings = DynamicsSettings()
    """Vehicle dynamics."""
    actions: ActionSettings = ActionSettings()
    """Actions of the policy."""
    camera: CameraSettings = CameraSettings()
    """Camera of the policy."""
    transforms: Annotated[tuple[Transform, ...], Parts(Transform, MOST_TRANSFORMS)] = (
        DEFAULT_TRANSFORMS
    )
    """Transforms of the image, in this order."""
    inputs: Inputs = DEFAULT_INPUTS
    """Inputs of the policy by name; `pixels` is the image that camera and transforms describe."""
    network: Network = SmallCnn()
    """Network of the policy."""
    returns: Returns = LeaveOneOut()
    """Return estimator."""
    objective: Objective = Reinforce()
    """Loss and learner."""
    optimizer: Optimizer = Adam()
    """Optimizer."""
    scheduler: Scheduler = Constant()
    """Learning-rate schedule."""
    collector: Collector = Episodes()
    """Collector."""
    trainer: TrainerSettings = TrainerSettings()
    """Training loop: stopping rule, gradients, threads, checkpoints."""
    demonstrations: str | None = None
    """Folder of demonstrations that a new run clones before it collects episodes; null for none."""
    cloning: CloningSettings = CloningSettings()
    """Behavior cloning, if demonstrations are given."""
    seed: Seed = 0
    """Root of all random streams: scenes, actions, initial weights."""
    device: str = "cpu"
    """Device of renderer and networks: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Renderer: raytrace, this package's ray tracer, or mujoco_warp, MuJoCo Warp's."""
    evaluate_after: Annotated[int, Whole(0, unit="episodes")] = 0
    """Episodes of a verdict on last.pt after training, in environments reserved for model selection
    (never for training or reported figures); 0 for none."""

    @pydantic.field_validator("*", mode="before")
    @classmethod
    def _of_default(cls, value: Any, info: pydantic.ValidationInfo) -> Any:
        return _of_variant(cls.model_fields[str(info.field_name)].default, value)

    def check(self) -> None:
        """Refuse parts that don't work together."""
        if self.renderer != "raytrace" and not self.appearance.is_minimal:
            self.refuse("renderer", "supports only appearance=minimal; give renderer=raytrace")
        self.dynamics.check_air()
        task, has_scene = self.task, bool(getattr(self.task, "scene", None))
        check_appearance(self.appearance, self.camera, task.object_region, task.name, has_scene)
        seen = {"camera": CameraSettings(), "transforms": DEFAULT_TRANSFORMS}
        unused = [name for name, default in seen.items() if getattr(self, name) != default]
        if unused and not any(isinstance(one, CameraPixels) for one in self.inputs.values()):
            raise InputError(
                f"{unused[0]} describes the input pixels, which inputs={[*self.inputs]} lacks; "
                f"leave it out and give settings such as inputs.{next(iter(self.inputs))}.size, or "
                "add pixels"
            )
        needs, objective = self.objective.needs, self.objective.name
        for name, part in needs.items():
            setting = getattr(self, name)
            if setting.is_known and not isinstance(setting, type(part)):
                raise InputError(
                    f"objective={objective} requires {name}={part.name}, got {name}={setting.name}"
                )
        for name, kind in {"returns": Gae, "collector": Rollouts}.items():
            part = getattr(self, name)
            if isinstance(part, kind) and name not in needs:
                raise InputError(
                    f"{name}={part.name} requires a critic, which objective={objective} does not "
                    f"have; set objective=ppo or a2c, or choose a different value of {name}"
                )

    def replace(self, **changes: Any) -> Self:
        """See `Settings`.

        A new objective brings the parts that it needs, unless they are given. A mapping without a
        name has values of the variant that it replaces, as on the command line.
        """
        objective = changes.get("objective")
        if isinstance(objective, str):
            objective = Objective.read(objective, "objective")
        needs = objective.needs if isinstance(objective, Objective) else {}
        for name, part in needs.items():
            if not isinstance(getattr(self, name), type(part)):
                changes.setdefault(name, part)
        for name, part in {**dict(self), **needs}.items():
            if name in changes:
                changes[name] = _of_variant(part, changes[name])
        return super().replace(**changes)


def _of_variant(part: object, value: Any) -> Any:
    """Return a mapping without a name as one of a part's variant, and anything else as it is."""
    is_unnamed = isinstance(value, Mapping) and not value.keys() & {"name", "_target_"}
    return {"name": part.name, **value} if is_unnamed and isinstance(part, Part) else value


class Logger(Part):
    """Settings of a TorchRL logger."""

    def make(self, *parts: Any, **options: Unpack[NetworkOptions]) -> Any:
        """Make the logger; raise an `InputError` if that fails."""
        try:
            return super().make(*parts, **options)
        except Exception as error:  # a missing package, a wrong argument, or a server out of reach
            text = " ".join(f"{error}".split()) or type(error).__name__
            raise InputError(
                f"logger _target_={self.target} can't be made ({text}); install the package that "
                "it needs, give its arguments as in +logger.NAME.exp_name=first, or choose another "
                "logger"
            ) from error


class Tensorboard(Logger, target="torchrl.record.loggers.tensorboard.TensorboardLogger"):
    """TensorBoard event files."""

    exp_name: str = "tensorboard"
    """Folder of this logger under log_dir."""
    log_dir: str = "outputs"
    """Where the logs go."""


class Wandb(Logger, target="torchrl.record.loggers.wandb.WandbLogger"):
    """Weights & Biases."""

    exp_name: str = "drone_rl"
    """Name of the run."""
    project: str = "drone_rl"
    """Project that the run belongs to."""
    save_dir: str = "outputs"
    """Where its files go."""
    offline: bool = False
    """Write files alone, for `wandb sync`."""


class Mlflow(Logger, target="torchrl.record.loggers.mlflow.MLFlowLogger"):
    """MLflow."""

    exp_name: str = "drone_rl"
    """Experiment that the run belongs to."""
    tracking_uri: str = "sqlite:///outputs/mlflow.db"
    """A database file, or the address of a server."""
