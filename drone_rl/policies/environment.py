"""Environments for training, with the transforms of policies."""

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
from drone_rl.config.transforms import DEFAULT_TRANSFORMS, Transform
from drone_rl.sim.dynamics import Dynamics
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown


def make_env(
    num_envs: int = 1,
    *,
    task: BaseTaskSettings | str | None = None,
    camera: CameraSettings | None = None,
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
    transforms: Sequence[Transform] = DEFAULT_TRANSFORMS,
    seed: int = 0,
    device: str = "cpu",
    **kwargs: Any,
) -> TransformedEnv:
    """Worlds to train in, as one TorchRL environment.

    Args:
        num_envs: How many.
        task: What the drone has to do: settings, or a name such as "pillars" for its defaults.
        camera: The frame that it takes.
        dynamics: How it moves; in computer-vision mode by default.
        actions: What it can be asked for, where dynamics are settings; moves by default.
        transforms: What becomes of the frame, in this order.
        seed: Root of the environments' random streams.
        device: Where they are drawn: "cpu", "cuda" or "cuda:N".
        kwargs: See `drone_rl.envs.DroneEnv`; renderer="mujoco_warp" draws by MuJoCo Warp.

    Raises:
        InputError: A setting is out of range; the message begins with its name.
    """
    _check(camera, "camera", CameraSettings)
    _check(actions, "actions", ActionSettings)
    if isinstance(dynamics, str | Mapping):
        _check(dynamics, "dynamics", DynamicsSettings)
    _check(kwargs.get("appearance"), "appearance", AppearanceSettings)
    several = isinstance(transforms, Sequence) and not isinstance(transforms, str)
    for transform in transforms if several else (transforms,):
        _check(transform, "transforms", Transform)
    motion = {"dynamics": dynamics, "actions": actions}
    base = envs.DroneEnv(num_envs, task, camera, seed=seed, device=device, **motion, **kwargs)
    return envs.with_transforms(base, [transform.make() for transform in transforms])


def _check(value: Any, name: str, kind: type) -> None:
    if value is not None and not isinstance(value, kind):
        raise InputError(f"{name}={shown(value)} is no {kind.__name__}; give a {kind.__name__}")
