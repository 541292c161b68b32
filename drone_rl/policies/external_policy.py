"""Third-party policies: any callable from frames to logits."""

import dataclasses
import functools
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import torch
from torchrl.envs import EnvBase

from drone_rl.config import (
    COMPUTER_VISION,
    MINIMAL,
    MOVES_SETTINGS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.config.configuration import Changes, as_changes
from drone_rl.config.inputs import Input, Inputs, describe_inputs, first_camera
from drone_rl.config.transforms import (
    Fault,
    Frame,
    Gray,
    Rgb,
    Standardize,
    Transform,
    as_transforms,
)
from drone_rl.policies import ExternalNetwork
from drone_rl.policies.environment import EnvOptions, make_env
from drone_rl.policies.external_network import Function, Logits
from drone_rl.policies.policy import BasePolicy, load_policy
from drone_rl.policies.self_check import check_on_episodes
from drone_rl.policies.zoo.description import output_of, shapes_of
from drone_rl.sim.dynamics import make_dynamics
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.display import table
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance, shown
from drone_rl.utils.seeding import Stream
from drone_rl.utils.settings import Settings, prefixed_errors

_TASK = TaskSettings()


@dataclasses.dataclass(frozen=True, kw_only=True)
class ExternalPolicy(BasePolicy):
    """A third-party network with its task, camera and transforms; see `policy_from`.

    It has no file, so third parties can't check its certificates.
    """

    name: str
    logits: Function = dataclasses.field(repr=False)
    task: BaseTaskSettings | Task[Any] = _TASK  # pyright: ignore[reportIncompatibleMethodOverride] (here and below: a field)
    camera: CameraSettings
    transforms: tuple[Transform, ...]
    """If empty, the callable gets the camera's RGB bytes."""
    inputs: Mapping[str, Input] | None = None
    """Several inputs by name instead, of which the callable gets a dictionary."""
    actions: ActionSettings = MOVES_SETTINGS  # pyright: ignore[reportIncompatibleMethodOverride]
    """One action for each logit."""
    own_dynamics: DynamicsSettings = COMPUTER_VISION  # pyright: ignore[reportIncompatibleMethodOverride]
    """The vehicle dynamics in training."""
    dynamics: DynamicsSettings = COMPUTER_VISION  # pyright: ignore[reportIncompatibleMethodOverride]
    """The vehicle dynamics of the evaluation."""
    own_appearance: AppearanceSettings = MINIMAL  # pyright: ignore[reportIncompatibleMethodOverride]
    """The appearance of the scenes in training."""
    appearance: AppearanceSettings = MINIMAL  # pyright: ignore[reportIncompatibleMethodOverride]
    """The appearance of the scenes in the evaluation."""

    @property
    def source(self) -> str:
        """Its name."""
        return self.name

    def in_task(self, task: Mapping[str, Any] | None = None, /, **changes: Any) -> "ExternalPolicy":
        """See `BasePolicy`."""
        changes = {**as_changes(task, "task"), **changes}
        if not isinstance(self.task, Settings):
            if changes:
                raise InputError(
                    f"task.{min(changes)} can't be changed in a task object; give policy_from the "
                    "task's settings"
                )
            return self
        changed = Changes(type(self.task)).read(changes, "task")
        with prefixed_errors("task"):
            return dataclasses.replace(self, task=self.task.replace(**changed))

    def in_dynamics(
        self, dynamics: Mapping[str, Any] | None = None, /, **changes: Any
    ) -> "ExternalPolicy":
        """See `BasePolicy`."""
        changes = {**as_changes(dynamics, "dynamics"), **changes}
        changed = Changes(DynamicsSettings).read(changes, "dynamics")
        with prefixed_errors("dynamics"):
            now = self.dynamics.replace(**changed)
        now.check_air()
        return dataclasses.replace(self, dynamics=now)

    def in_appearance(self, appearance: AppearanceSettings | str) -> "ExternalPolicy":
        """Return the same policy in scenes of another appearance, which may be a name."""
        appearance = Instance(AppearanceSettings).read(appearance, "appearance")
        return dataclasses.replace(self, appearance=appearance)

    def make_env(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
        **options: Unpack[EnvOptions],
    ) -> EnvBase:
        """See `BasePolicy`."""
        dynamics = options["dynamics"] = options.get("dynamics") or self.dynamics
        options.setdefault("appearance", self.appearance)
        if isinstance(dynamics, DynamicsSettings):
            options.setdefault("actions", self.actions)
        seen: dict[str, Any] = {"inputs": self.inputs}
        if self.inputs is None:
            seen = {"camera": self.camera, "transforms": self.transforms or (Rgb(),)}
        return make_env(
            num_envs,
            task=self.task,
            **seen,
            seed=seed,
            stream=stream,
            device=device,
            **options,
        )

    def make_network(self, device: str | torch.device = "cpu") -> ExternalNetwork:
        """Return its network; raise an `InputError` as `ExternalNetwork` does."""
        shapes: Any = None
        if self.inputs is None:
            frame = Frame((self.camera.height, self.camera.width, 3))
            for transform in self.transforms or (Rgb(),):
                frame = output_of(transform, frame)
            shapes = frame.shape
        else:
            shapes = shapes_of(describe_inputs(self.inputs))
        network = ExternalNetwork(
            self.logits,
            shapes,
            make_dynamics(as_task(self.task).make_dynamics, self.dynamics, self.actions).actions,
            takes_bytes=not self.transforms and self.inputs is None,
            device=device,
        )
        network.owner = f"policy={self.name}"
        return network

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        sees = " > ".join(transform.name for transform in self.transforms) or "RGB bytes"
        sees = sees if self.inputs is None else ", ".join(self.inputs)
        rows = [["network", type(self.logits).__name__], ["sees", sees], ["file", "none"]]
        return table(["policy", self.name], rows)


def policy_from(
    logits: Logits,
    *,
    task: BaseTaskSettings | Task[Any] | str | None = None,
    camera: CameraSettings | None = None,
    dynamics: DynamicsSettings = COMPUTER_VISION,
    actions: ActionSettings = MOVES_SETTINGS,
    appearance: AppearanceSettings | str = MINIMAL,
    transforms: Transform | Sequence[Transform] | None = None,
    inputs: Mapping[str, Input | str] | Sequence[Input | str] | None = None,
    env: Any = None,
    name: str | None = None,
) -> ExternalPolicy:
    """Return a third-party policy to judge, evaluate and explain.

    A verdict on a callable presumes that it does not look at the program that judges it: Python
    code can read the simulator's state and count its calls. What comes from strangers can be judged
    as a policy file (`drone_rl.load_policy`), which holds weights and no code.

    A torch module is copied and set to evaluation mode; all explanations support it. Fewer
    explanations support other torch functions, and still fewer support other callables. The policy
    takes a few steps, in which its logits must not depend on the batch and, of a model of
    Stable-Baselines3, its actions must be those of the model's own `predict`.

    Args:
        logits: Callable from a batch of transformed frames, floats (N, C, H, W), to a logit for
            each action, a tensor or an array (N, number of actions); or a model of
            Stable-Baselines3.
        task: The task, its settings, or its name for the default settings.
        camera: The policy's camera. By default, its images have the size in
            `logits.observation_shape` if there is one.
        dynamics: Vehicle dynamics.
        actions: The action space.
        appearance: Appearance of the scenes in training, or the name of one such as "fog".
        transforms: Transform of the image, or several in order; an empty list for the camera's RGB
            bytes (N, H, W, 3). By default `Gray` and `Standardize`, or `Rgb` if `logits` was
            trained on color frames. Those of a model of Stable-Baselines3 come before the wrappers
            of its environment.
        inputs: Several inputs instead of camera and transforms, as in `drone_rl.make_env`; the
            callable gets a dictionary of floats (N, *) by their names.
        env: Environment of Stable-Baselines3 in which the model was trained, with its wrappers
            (`VecNormalize`, `VecFrameStack`, observation wrappers of Gymnasium); that of the model
            by default. Task, camera, dynamics and actions default to those of the environment.
        name: Name in reports; that of the callable by default.

    Raises:
        InputError: It does not accept such frames, does not return one logit for each action, or
            acts otherwise than its library.
    """
    network = _checked_logits(logits, env)
    of_env: Mapping[str, Any] = getattr(network, "conditions", {})
    observations: Any = getattr(network, "observations", None)
    given = of_env.get("inputs") if inputs is None else inputs
    made: Any = Instance(Inputs | None).read(given, "inputs")
    if made is not None:
        if camera is not None or transforms is not None:
            raise InputError("camera= and transforms= have no effect with inputs=; leave them out")
        camera, transforms = first_camera(describe_inputs(made)), ()
    if camera is not None:
        camera = Instance(CameraSettings).read(camera, "camera")
    dynamics = Instance(DynamicsSettings).read(dynamics, "dynamics")
    dynamics.check_air()
    actions = Instance(ActionSettings).read(actions, "actions")
    if isinstance(task, str):
        task = BaseTaskSettings.read(task, "task")
    before_wrappers = None if transforms is None else as_transforms(transforms)
    dynamics = of_env.get("dynamics", dynamics) if dynamics is COMPUTER_VISION else dynamics
    trained_in: AppearanceSettings = Instance(AppearanceSettings).read(appearance, "appearance")
    policy = ExternalPolicy(
        name=name or of_env.get("name") or getattr(network, "__name__", type(network).__name__),
        logits=network,
        task=task or of_env.get("task") or _TASK,
        camera=camera or of_env.get("camera") or _camera_of(network),
        transforms=(
            _transforms_of(network, before_wrappers)
            if observations is None or made is not None
            else observations.all_transforms(before_wrappers)
        ),
        inputs=made,
        actions=of_env.get("actions", actions) if actions is MOVES_SETTINGS else actions,
        own_dynamics=dynamics,
        dynamics=dynamics,
        own_appearance=trained_in,
        appearance=trained_in,
    )
    policy.make_network()  # raises errors early
    clean = tuple(step for step in policy.transforms if not isinstance(step, Fault))
    checked = dataclasses.replace(policy, transforms=clean)
    if observations is None:
        check_on_episodes(checked)
    else:
        model: Any = network
        predict = functools.partial(model.predict, transforms=before_wrappers)
        check_on_episodes(checked, predict, observations.names)
    return policy


def _checked_logits(logits: Any, env: Any) -> Function:
    """Return the callable, of a model of Stable-Baselines3 its logits; see `policy_from`."""
    owner = getattr(logits, "__self__", logits)  # of a bound method, such as policy.act_batch
    if isinstance(owner, str | Path | BasePolicy):
        what = f"policy={owner.name}" if isinstance(owner, BasePolicy) else shown(owner)
        raise InputError(f"policy_from takes callables; give {what} itself to judge or explain")
    if _is_sb3_model(logits):
        from drone_rl.policies.sb3 import Sb3Logits  # needs Stable-Baselines3

        return Sb3Logits(logits, env)
    if env is not None:
        raise InputError(
            f"env= is of models of Stable-Baselines3, but policy={shown(logits)} is none; give "
            "task=, camera= and transforms="
        )
    if isinstance(logits, type) or not callable(logits):
        raise InputError(
            f"policy={shown(logits)} is no policy; give a callable from images to logits, or the "
            "name or file of a policy"
        )
    return logits


def _camera_of(logits: Function) -> CameraSettings:
    shape = getattr(logits, "observation_shape", None)
    return CameraSettings() if shape is None else CameraSettings(height=shape[1], width=shape[2])


def _transforms_of(
    logits: Function, transforms: tuple[Transform, ...] | None
) -> tuple[Transform, ...]:
    if transforms is not None:
        return transforms
    shape = getattr(logits, "observation_shape", None)
    return (Rgb(),) if shape is not None and shape[0] == 3 else (Gray(), Standardize())


def _is_sb3_model(which: Any) -> bool:
    """Return whether this is a Stable-Baselines3 algorithm, without importing the library."""
    module = sys.modules.get("stable_baselines3.common.base_class")
    return module is not None and isinstance(which, module.BaseAlgorithm)


def as_policy(
    which: str | Path | BasePolicy | Logits,
    outputs: str | Path = "outputs",
    *,
    task: Mapping[str, Any] | None = None,
    dynamics: Mapping[str, Any] | None = None,
    appearance: AppearanceSettings | str | None = None,
) -> BasePolicy:
    """Convert a callable, see `policy_from`, a Stable-Baselines3 model or a file to a policy.

    `outputs` is the folder of the runs, see `load_policy`. `task` and `dynamics` are settings to
    change of the policy's own, `appearance` replaces that of its scenes.

    Raises:
        InputError: There is no such policy, or it or a setting is unusable.
    """
    policy = _converted(which, outputs)
    policy = policy.in_task(task) if task else policy
    policy = policy.in_dynamics(dynamics) if dynamics else policy
    return policy if appearance is None else policy.in_appearance(appearance)


def _converted(which: str | Path | BasePolicy | Logits, outputs: str | Path) -> BasePolicy:
    if isinstance(which, BasePolicy):
        return which
    is_file = isinstance(which, str | Path)
    return load_policy(which, outputs=outputs) if is_file else policy_from(which)
