"""Third-party policies: any callable from frames to logits."""

import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch
from torchrl.envs import TransformedEnv

from drone_rl.config import (
    COMPUTER_VISION,
    MOVES_SETTINGS,
    ActionSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.config.configuration import Changes
from drone_rl.config.transforms import Frame, Gray, Rgb, Standardize, Transform
from drone_rl.policies import ForeignNetwork
from drone_rl.policies.environment import make_env
from drone_rl.policies.external_network import Logits
from drone_rl.policies.policy import Pilot, load_policy
from drone_rl.policies.zoo.description import output_of
from drone_rl.sim.dynamics import make_dynamics
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.display import table
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings, below


@dataclasses.dataclass(frozen=True)
class ForeignPolicy(Pilot):
    """A third-party network with its task, camera and transforms; see `policy_from`.

    It has no file, so no certificate of it can be checked by others.
    """

    name: str
    logits: Logits = dataclasses.field(repr=False)
    own_task: BaseTaskSettings | Task[Any]
    camera: CameraSettings
    transforms: tuple[Transform, ...]
    """None: the camera's RGB bytes."""
    own_dynamics: DynamicsSettings = COMPUTER_VISION  # pyright: ignore[reportIncompatibleMethodOverride] (a field)
    """How its drone moved when it was made."""
    actions: ActionSettings = MOVES_SETTINGS  # pyright: ignore[reportIncompatibleMethodOverride] (a field)
    """What its logits ask for."""
    flown: DynamicsSettings | None = None
    """How its drone moves now; as before by default."""

    @property
    def dynamics(self) -> DynamicsSettings:
        """See `Pilot`."""
        return self.flown or self.own_dynamics

    @property
    def task(self) -> BaseTaskSettings | Task[Any]:
        """What it flies in."""
        return self.own_task

    @property
    def origin(self) -> dict[str, Any]:
        """Its name; nothing is known of its training."""
        return {"policy": self.name, "trained": None}

    def in_task(self, **changes: Any) -> "ForeignPolicy":
        """See `Pilot`."""
        if not isinstance(self.own_task, Settings):
            if changes:
                raise InputError(f"task.{min(changes)} is unknown; the task has no settings")
            return self
        changed = Changes(type(self.own_task)).read(changes, "task")
        with below("task"):
            return dataclasses.replace(self, own_task=self.own_task.replace(**changed))

    def in_dynamics(self, **changes: Any) -> "ForeignPolicy":
        """See `Pilot`."""
        changed = Changes(DynamicsSettings).read(changes, "dynamics")
        with below("dynamics"):
            flown = self.dynamics.replace(**changed)
        flown.check_air()
        return dataclasses.replace(self, flown=flown)

    def _make_env(self, num_envs: int, options: dict[str, Any]) -> TransformedEnv:
        task: Any = self.own_task
        dynamics = options.pop("dynamics", None) or self.dynamics
        if isinstance(dynamics, DynamicsSettings):
            options.setdefault("actions", self.actions)
        parts = {"task": task, "dynamics": dynamics, "transforms": self.transforms or (Rgb(),)}
        return make_env(num_envs, camera=self.camera, **parts, **options)

    def make_network(self, device: str | torch.device = "cpu") -> ForeignNetwork:
        """See `Pilot`.

        Raises:
            InputError: It takes no such frames, or its logits are not one an action.
        """
        frame = Frame((self.camera.height, self.camera.width, 3))
        for transform in self.transforms or (Rgb(),):
            frame = output_of(transform, frame)
        network = ForeignNetwork(
            self.logits,
            frame.shape,
            make_dynamics(
                as_task(self.own_task).make_dynamics, self.dynamics, self.actions
            ).actions,
            takes_bytes=not self.transforms,
            device=device,
        )
        network.owner = f"policy={self.name}"
        return network

    def _repr_html_(self) -> str:
        """Shows itself in a notebook."""
        sees = " > ".join(transform.name for transform in self.transforms) or "RGB bytes"
        rows = [["network", type(self.logits).__name__], ["sees", sees], ["file", "none"]]
        return table(["policy", self.name], rows)


def policy_from(
    logits: Logits,
    *,
    task: BaseTaskSettings | Task[Any] | None = None,
    camera: CameraSettings | None = None,
    dynamics: DynamicsSettings = COMPUTER_VISION,
    actions: ActionSettings = MOVES_SETTINGS,
    transforms: Sequence[Transform] | None = None,
    name: str | None = None,
) -> ForeignPolicy:
    """A policy that was made elsewhere, to be judged, evaluated and explained.

    Of a torch module a copy is taken when it is asked, in evaluation mode, and all can be explained
    of it. Of another torch function some explanations are left out, of any other callable more.

    Args:
        logits: From a batch of frames, floats (N, C, H, W) after the transforms, to a logit for
            each action (N, number of actions), as a tensor or an array.
        task: What it flies in.
        camera: The frame that the drone takes; by default as large as the frames that `logits`
            was trained on, if it says so (`observation_shape`, as `Sb3Logits` does).
        dynamics: How it moves.
        actions: What the logits ask for.
        transforms: What becomes of the frame before it gets it; with an empty list it gets the
            camera's own, RGB bytes (N, H, W, 3). By default `Gray` and `Standardize`, or `Rgb` if
            `logits` was trained on colour frames.
        name: For people; that of the callable by default.

    Raises:
        InputError: It takes no such frames, or its logits are not one an action.
    """
    if not callable(logits):
        raise InputError(
            f"policy_from got a {type(logits).__name__}; give a callable from pictures to logits"
        )
    policy = ForeignPolicy(
        name=name or getattr(logits, "__name__", type(logits).__name__),
        logits=logits,
        own_task=task or TaskSettings(),
        camera=camera or _camera_of(logits),
        transforms=_transforms_of(logits) if transforms is None else tuple(transforms),
        own_dynamics=dynamics,
        actions=actions,
    )
    policy.make_network()  # refuses now what could not be asked later
    return policy


def _camera_of(logits: Logits) -> CameraSettings:
    shape = getattr(logits, "observation_shape", None)
    return CameraSettings() if shape is None else CameraSettings(height=shape[1], width=shape[2])


def _transforms_of(logits: Logits) -> tuple[Transform, ...]:
    shape = getattr(logits, "observation_shape", None)
    is_colour = getattr(logits, "observes_bytes", False) or (shape is not None and shape[0] == 3)
    return (Rgb(),) if is_colour else (Gray(), Standardize())


def _is_sb3_model(which: Any) -> bool:
    """Whether this is an algorithm of Stable-Baselines3, which is not imported to find out."""
    module = sys.modules.get("stable_baselines3.common.base_class")
    return module is not None and isinstance(which, module.BaseAlgorithm)


def as_pilot(which: str | Path | Pilot | Logits, outputs: str | Path = "outputs") -> Pilot:
    """Return a policy as it is, or make one of a callable or a file.

    Args:
        which: The policy, a callable as for `policy_from`, a model of Stable-Baselines3, or
            what `load_policy` takes.
        outputs: Folder of the runs.

    Raises:
        InputError: There is none, or it is unusable.
    """
    if isinstance(which, Pilot):
        return which
    if _is_sb3_model(which):
        from drone_rl.policies.sb3 import Sb3Logits  # needs Stable-Baselines3

        model: Any = which
        return policy_from(Sb3Logits(model), name=f"{type(model).__name__} of Stable-Baselines3")
    is_file = isinstance(which, str | Path)
    return load_policy(which, outputs=outputs) if is_file else policy_from(which)
