"""Environments for training, with the transforms of policies."""

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from torchrl.envs import TransformedEnv

from drone_rl import envs
from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.transforms import DEFAULT_TRANSFORMS, Transform, as_transforms
from drone_rl.sim.dynamics import Dynamics
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance, shown


def make_env(
    num_envs: int = 1,
    *,
    task: BaseTaskSettings | str | None = None,
    camera: CameraSettings | None = None,
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
    transforms: Transform | Sequence[Transform] = DEFAULT_TRANSFORMS,
    seed: int = 0,
    device: str = "cpu",
    **kwargs: Any,
) -> TransformedEnv:
    """Return environments to train in, as one batched TorchRL environment.

    Args:
        num_envs: Batch size.
        task: Settings of the task, or a name such as "pillars" for its defaults.
        camera: The policy's camera.
        dynamics: Vehicle dynamics; computer-vision mode by default.
        actions: Action space, if `dynamics` are settings; the moves by default.
        transforms: Transform of the image, or several in this order.
        seed: Root of the environments' random streams.
        device: Device of the renderer: "cpu", "cuda" or "cuda:N".
        kwargs: See `drone_rl.envs.DroneEnv`, such as renderer="mujoco_warp", and `appearance`, also
            as a name such as "fog".

    Raises:
        InputError: A setting is out of range; the message begins with its name.
    """
    _check(camera, "camera", CameraSettings)
    _check(actions, "actions", ActionSettings)
    if isinstance(dynamics, str | Mapping):
        _check(dynamics, "dynamics", DynamicsSettings)
    if isinstance(dynamics, DynamicsSettings):
        dynamics.check_air()
    if kwargs.get("appearance") is not None:
        kwargs["appearance"] = Instance(AppearanceSettings).read(kwargs["appearance"], "appearance")
    steps = as_transforms(transforms)
    for unknown in kwargs.keys() - inspect.signature(envs.DroneEnv.__init__).parameters.keys():
        raise InputError(
            f"{unknown} is no argument of make_env; settings of the task are given as "
            "task=drone_rl.TaskSettings(num_cubes=2), for example"
        )
    motion = {"dynamics": dynamics, "actions": actions}
    base = envs.DroneEnv(num_envs, task, camera, seed=seed, device=device, **motion, **kwargs)
    return envs.with_transforms(base, [transform.make() for transform in steps])


def _check(value: Any, name: str, kind: type) -> None:
    if value is not None and not isinstance(value, kind):
        raise InputError(f"{name}={shown(value)} is not of type {kind.__name__}; give one")
