"""Environments for training, with the transforms of policies."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypedDict, Unpack

from torchrl.envs import EnvBase

from drone_rl import envs
from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.inputs import Input, Inputs, describe_inputs, first_camera
from drone_rl.config.transforms import DEFAULT_TRANSFORMS, Transform, as_transforms
from drone_rl.sim.dynamics import Dynamics
from drone_rl.sim.rendering.renderer import RendererFactory
from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import Instance, shown
from drone_rl.utils.seeding import Stream


class EnvOptions(TypedDict, total=False):
    """Further arguments of all functions that make environments; see `drone_rl.envs.DroneEnv`."""

    dynamics: DynamicsSettings | Dynamics | None
    """Vehicle dynamics; the task's or the policy's by default."""
    actions: ActionSettings | None
    """Action space, if `dynamics` are settings; the moves or the policy's by default."""
    appearance: AppearanceSettings | str | None
    """Appearance of the scenes, or the name of one such as "fog"."""
    renderer: str | RendererFactory
    """"raytrace", "mujoco_warp" or a function that makes a renderer."""
    pixels: bool
    """Whether to render."""
    first_world: int
    """Number of the first environment."""
    num_shards: int | None
    """Threads that render on the CPU; the number of cores by default."""


def check_names(function: Callable[..., Any], options: Iterable[str]) -> None:
    """Raise an `InputError` if an option of a function is none of `EnvOptions`."""
    names = [*inspect.signature(function).parameters, *EnvOptions.__annotations__]
    names = [name for name in names if name not in ("self", "options")]
    for name in options:
        if name not in EnvOptions.__annotations__:
            valid = ", ".join(names)
            raise InputError(f"{name} is unknown; valid names: {valid}{did_you_mean(name, names)}")


def make_env(
    num_envs: int = 1,
    *,
    task: BaseTaskSettings | Task[Any] | str | None = None,
    camera: CameraSettings | None = None,
    transforms: Transform | Sequence[Transform] = DEFAULT_TRANSFORMS,
    inputs: Mapping[str, Input | str] | Sequence[Input | str] | None = None,
    seed: int = 0,
    stream: Stream = Stream.WORLDS,
    device: str = "cpu",
    **options: Unpack[EnvOptions],
) -> EnvBase:
    """Return environments to train in, as one batched TorchRL environment.

    Args:
        num_envs: Batch size.
        task: Settings of the task, or its name for the defaults.
        camera: The policy's camera.
        transforms: Transform of the image, or several in this order.
        inputs: Inputs by name instead of "pixels", such as `{"depth": DepthImage(camera="down")}`,
            or a list of names such as `["gray", "goal"]`.
        seed: Root of the environments' random streams.
        stream: Purpose of the environments.
        device: Device of the renderer: "cpu", "cuda" or "cuda:N".
        options: See `EnvOptions`.

    Raises:
        InputError: A setting is unknown or out of range; the message begins with its name.
    """
    check_names(make_env, options)
    camera = Instance(CameraSettings | None).read(camera, "camera")
    actions = Instance(ActionSettings | None).read(options.get("actions"), "actions")
    dynamics = options.get("dynamics")
    if isinstance(dynamics, str | dict):
        raise InputError(f"dynamics={shown(dynamics)} is no DynamicsSettings; give one")
    if isinstance(dynamics, DynamicsSettings):
        dynamics.check_air()
    appearance = Instance(AppearanceSettings | None).read(options.get("appearance"), "appearance")
    others: Any = {**options, "actions": actions, "appearance": appearance}
    described = None
    if inputs is not None:
        if camera is not None or transforms is not DEFAULT_TRANSFORMS:
            raise InputError(
                "camera= and transforms= describe the default input; leave them out, or describe "
                "all inputs in inputs="
            )
        described = describe_inputs(Instance(Inputs).read(inputs, "inputs"))
        camera, transforms = first_camera(described), ()
    made = [step.make() for step in as_transforms(transforms)] if others.get("pixels", True) else ()
    base = envs.DroneEnv(
        num_envs,
        task,
        camera,
        transforms=made,
        inputs=described,
        seed=seed,
        stream=stream,
        device=device,
        **others,
    )
    return envs.with_others(base, made)
