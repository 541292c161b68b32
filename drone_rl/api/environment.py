"""Worlds as a TorchRL environment, with the pixels that policies see."""

from collections.abc import Sequence
from typing import Any

from torchrl.envs import TransformedEnv

from drone_rl import envs
from drone_rl.settings.transforms import Gray, Standardize, Transform
from drone_rl.sim.dynamics import Dynamics
from drone_rl.sim.settings import (
    ActionSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)


def make_env(
    num_envs: int = 1,
    *,
    task: BaseTaskSettings | None = None,
    camera: CameraSettings | None = None,
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
    transforms: Sequence[Transform] = (Gray(), Standardize()),
    seed: int = 0,
    device: str = "cpu",
    **kwargs: Any,
) -> TransformedEnv:
    """Worlds to train in, as one TorchRL environment.

    Args:
        num_envs: How many.
        task: What the drone has to do.
        camera: The picture that it takes.
        dynamics: How it moves; in computer-vision mode by default.
        actions: What it can be asked for, where dynamics are settings; moves by default.
        transforms: What becomes of the picture, in this order.
        seed: Root of the worlds' random streams.
        device: Where they are drawn: "cpu", "cuda" or "cuda:N".
        kwargs: See `drone_rl.envs.DroneEnv`; renderer="mujoco_warp" draws by MuJoCo Warp.

    Raises:
        InputError: A setting is out of range; the message begins with its name.
    """
    motion = {"dynamics": dynamics, "actions": actions}
    base = envs.DroneEnv(num_envs, task, camera, seed=seed, device=device, **motion, **kwargs)
    return envs.with_transforms(base, [transform.make() for transform in transforms])
