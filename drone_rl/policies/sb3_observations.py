"""Observations of Stable-Baselines3 models: what the wrappers of an environment do to frames."""

import copy
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any

import numpy as np
import torch
from gymnasium import ActionWrapper, Env, ObservationWrapper, RewardWrapper, Wrapper, spaces
from gymnasium.vector import (
    SyncVectorEnv,
    VectorActionWrapper,
    VectorEnv,
    VectorRewardWrapper,
    VectorWrapper,
)
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    VecEnv,
    VecEnvWrapper,
    VecFrameStack,
    VecNormalize,
    VecTransposeImage,
)
from stable_baselines3.common.vec_env.stacked_observations import StackedObservations
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.config.registry import implements
from drone_rl.config.transforms import Frame, Rgb, Stack, Transform
from drone_rl.envs import Pipeline
from drone_rl.envs.gymnasium.environments import DroneWorld, DroneWorlds
from drone_rl.envs.sb3.worlds import Sb3Worlds
from drone_rl.envs.transforms import PixelTransform
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole

Function = Callable[[NDArray[Any]], NDArray[Any]]
"""A batch of observations to a batch of observations."""
_LIBRARIES = ("gymnasium.", "stable_baselines3.", "drone_rl.")
_NEUTRAL = {
    "Autoreset",
    "DictInfoToList",
    "DummyVecEnv",
    "HumanRendering",
    "Monitor",
    "NormalizeReward",
    "OrderEnforcing",
    "PassiveEnvChecker",
    "RecordEpisodeStatistics",
    "RecordVideo",
    "RenderCollection",
    "Sb3Worlds",
    "SyncVectorEnv",
    "TimeLimit",
    "VecCheckNan",
    "VecMonitor",
    "VecVideoRecorder",
}
"""Classes of these libraries that change neither observations nor actions."""
_REPEATING = {
    "MaxAndSkipEnv",
    "MaxAndSkipObservation",
    "RepeatAction",
    "StickyActionEnv",
}
"""Classes of these libraries that repeat actions and are no `ActionWrapper`."""


class Observations:
    """How an environment makes a model's observations from camera frames.

    It reads the wrappers and copies those with statistics; the environment does not change.
    """

    def __init__(self, env: VecEnv | None, space: Any) -> None:
        """Read the wrappers of an environment with observations of `space`; None: only the space.

        Raises:
            InputError: Its wrappers can't be read, or change actions, or it observes the ground
                truth instead of images.
        """
        wrappers, world = ([], None) if env is None else _unwrap(env)
        self.space, self.names = space, [type(wrapper).__name__ for wrapper in wrappers]
        if not isinstance(space, spaces.Box) and (wrappers or world is None):
            raise InputError(
                f"{', '.join(self.names) or 'an unknown environment'} makes the dictionary that "
                "the model observes, and only those of drone_rl can be read; give "
                "drone_rl.policy_from env=, the environment of the training, without wrappers "
                "that change observations"
            )
        self.conditions: dict[str, Any] = _conditions(world)
        self.transforms: tuple[Transform, ...] | None = None
        self.reason = (
            "no environment is given; give drone_rl.policy_from env=, the environment of the "
            "training with its wrappers"
        )
        if world is not None:
            self.transforms = world.batch.options.transforms or (Rgb(),)
        elif _is_color(space):
            self.transforms, self.conditions["camera"] = (Rgb(),), _camera(space)
        unknown = [i for i, wrapper in enumerate(wrappers) if not _is_known(wrapper)]
        if unknown:
            self.transforms = None
            self.reason = (
                f"it has {type(wrappers[unknown[-1]]).__name__}; replace it with a "
                "gymnasium.ObservationWrapper (or RewardWrapper) without a step of its own"
            )
            wrappers = wrappers[unknown[-1] + 1 :]
        if all(isinstance(wrapper, VecTransposeImage) for wrapper in wrappers):
            wrappers = []  # `to_space` moves the channels
        self._wrappers = wrappers
        self._inner = _space_of(_inside(wrappers[0])) if wrappers else space

    space: Any
    """Of the model: a box, or a dictionary of several inputs."""
    names: list[str]
    """Names of the wrappers that change observations, the innermost first."""
    conditions: dict[str, Any]
    """Camera, task, dynamics and actions of the environment, as far as they are known."""
    transforms: tuple[Transform, ...] | None
    """From the camera to the innermost wrapper; None if unknown."""
    reason: str
    """Why they are unknown, and the remedy."""

    def __deepcopy__(self, memo: dict[int, Any]) -> "Observations":
        """Return itself, so that copies of a network share the environment."""
        return self

    def all_transforms(
        self, transforms: Sequence[Transform] | None = None
    ) -> tuple[Transform, ...]:
        """Return the transforms from the camera's frame to (C, H, W) with those of the wrappers.

        Args:
            transforms: Transforms up to the wrappers; by default those of the environment.

        Raises:
            InputError: There are none, and those of the environment are unknown.
        """
        first = self.transforms if transforms is None else tuple(transforms)
        if first is None:
            raise InputError(
                f"the model observes {self.space.dtype} of shape {self.space.shape}, and how its "
                f"environment makes them from images is unknown: {self.reason}, or give "
                "drone_rl.policy_from transforms= that do the same"
            )
        if not self._wrappers:
            return first
        steps: list[Transform] = []
        functions: list[Function] = [_into(self._inner)]
        for is_stack, some in itertools.groupby(
            self._wrappers, lambda wrapper: isinstance(wrapper, VecFrameStack)
        ):
            if not is_stack:
                functions += map(_function, some)
                continue
            for wrapper in some:
                steps += [Wrapped(functions=functions), _stack(wrapper)]
                functions = []
        return (*first, *steps, Wrapped(functions=[*functions, _from(self.space)]))

    def of_episode(
        self, frames: Tensor, transforms: Sequence[Transform] | None = None
    ) -> NDArray[Any]:
        """Return the observations of one episode by the library's own wrappers.

        Args:
            frames: RGB, uint8. Shape: (T, H, W, 3).
            transforms: Transforms up to the wrappers, if those of the environment are unknown.
        """
        first = transforms if self.transforms is None else self.transforms
        pipeline = Pipeline([transform.make() for transform in first or ()])
        pixels = [pipeline(frame[None], starts=not i) for i, frame in enumerate(frames)]
        seen = [_into(self._inner)(one.numpy()) for one in pixels]
        for wrapper in self._wrappers:
            if isinstance(wrapper, VecFrameStack):
                seen = _stacked(wrapper, seen)
            else:
                seen = list(map(_function(wrapper), seen))
        return np.concatenate(seen)


class Wrapped(Transform):
    """What wrappers do to observations; it has no name, so that no file can contain it."""

    functions: tuple[Function, ...] = ()
    """Applied in order to batches of observations."""

    def output(self, frame: Frame) -> Frame | None:
        """Return None: only a call shows the shape."""
        return None


@implements(Wrapped)
class _WrappedPixels(PixelTransform):
    def __init__(self, functions: Sequence[Function]) -> None:
        super().__init__()
        self._functions = functions

    def _apply_transform(self, obs: Tensor) -> Tensor:
        batch = obs.cpu().numpy()
        for function in self._functions:
            batch = function(batch)
        return torch.from_numpy(batch).to(obs.device)


class StackedFrames(Stack):
    """Frames as `VecFrameStack` stacks them: zeros before the first one of an episode."""

    dim: Annotated[int, Whole(-3, -1)] = -3
    """Dimension along which they are concatenated."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of TorchRL's transform."""
        return {**super().arguments(), "dim": self.dim, "padding": "constant"}

    def _transformed(self, frame: Frame) -> Frame:
        shape = list(frame.shape)
        shape[self.dim] *= self.N
        return Frame(tuple(shape), frame.is_float)


def to_space(pixels: Tensor, space: spaces.Box) -> Tensor:
    """Convert frames (N, C, H, W), bytes as 0 to 1, to observations (N, *) in a model's layout.

    Raises:
        InputError: They have another shape.
    """
    shape = tuple(pixels.shape[1:])
    if space.dtype == np.uint8:
        pixels = pixels * 255.0
    if space.shape != shape and space.shape == (*shape[1:], shape[0]):
        return pixels.movedim(1, -1)
    is_flat = shape[0] == 1 and np.prod(shape) == np.prod(space.shape)
    if space.shape != shape and not is_flat:
        raise InputError(
            f"the model observes {space.shape}, and the transforms return images of {shape}; give "
            "drone_rl.policy_from the camera= and transforms= of its training"
        )
    return pixels.reshape(len(pixels), *space.shape)


def channels_first(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape (C, H, W) of observations; the smaller end of a shape is the channels."""
    if len(shape) != 3:
        return (1,) * (3 - len(shape)) + shape
    return shape if shape[0] <= shape[-1] else (shape[-1], *shape[:-1])


def _into(space: spaces.Box) -> Function:
    def convert(batch: NDArray[Any]) -> NDArray[Any]:
        seen = to_space(torch.from_numpy(batch), space).numpy()
        return seen.round().astype(np.uint8) if space.dtype == np.uint8 else seen

    return convert


def _from(space: spaces.Box) -> Function:
    def convert(batch: NDArray[Any]) -> NDArray[Any]:
        batch = batch.astype(np.float32) / (255 if space.dtype == np.uint8 else 1)
        shape = channels_first(batch.shape[1:])
        is_last = batch.ndim == 4 and batch.shape[1:] != shape
        return np.moveaxis(batch, -1, 1) if is_last else batch.reshape(len(batch), *shape)

    return convert


def _unwrap(env: Any) -> tuple[list[Any], DroneWorld | DroneWorlds]:
    """Return the wrappers that change observations, innermost first, and the environment in them.

    Of several environments side by side it is the first.
    """
    *outer, world = _layers(env)
    if not isinstance(world, DroneWorld | DroneWorlds):
        name = type(world).__name__
        raise InputError(
            f"{name} is no environment of drone_rl, or hides those in other processes, so that its "
            "wrappers can't be read; give drone_rl.policy_from env=, a DummyVecEnv of the "
            "environment of the training with its wrappers"
        )
    acting = [type(wrapper).__name__ for wrapper in outer if _changes_actions(wrapper)]
    if acting:
        raise InputError(
            f"{acting[0]} changes actions, and a policy is judged by its own actions; train "
            "without it, or give a callable from images to the logits of the changed actions"
        )
    return [wrapper for wrapper in reversed(outer) if not _keeps(wrapper)], world


def _layers(env: Any) -> Iterator[Any]:
    """Yield an environment and those in it, the outermost first."""
    while env is not None:
        yield env
        env = _inside(env)


def _inside(env: Any) -> Any:
    """Return the environment in a wrapper; None if it is no wrapper, or that can't be seen."""
    if isinstance(env, DummyVecEnv | SyncVectorEnv):
        return env.envs[0]
    if isinstance(env, VecEnvWrapper):
        return env.venv
    return env.env if isinstance(env, Sb3Worlds | Wrapper | VectorWrapper) else None


def _space_of(env: Any) -> Any:
    """Return the space of one environment's observations."""
    return env.single_observation_space if isinstance(env, VectorEnv) else env.observation_space


def _keeps(wrapper: Any) -> bool:
    """Return whether observations and actions pass a wrapper unchanged."""
    if isinstance(wrapper, VecNormalize):
        return not wrapper.norm_obs
    kind = type(wrapper)
    is_library = f"{kind.__module__}.".startswith(_LIBRARIES)
    return (is_library and kind.__name__ in _NEUTRAL) or any(
        isinstance(wrapper, base) and kind.step is base.step
        for base in (RewardWrapper, VectorRewardWrapper)
    )


def _changes_actions(wrapper: Any) -> bool:
    is_repeating = any(kind.__name__ in _REPEATING for kind in type(wrapper).__mro__)
    return is_repeating or isinstance(wrapper, ActionWrapper | VectorActionWrapper)


def _is_known(wrapper: Any) -> bool:
    if isinstance(wrapper, ObservationWrapper):
        return type(wrapper).step is ObservationWrapper.step
    return isinstance(wrapper, VecNormalize | VecTransposeImage | VecFrameStack)


class _Spaces(Env[Any, Any]):
    """What a wrapper may read of its environment: constants, not the state."""

    def __init__(self, env: Any) -> None:
        self.observation_space, self.action_space = env.observation_space, env.action_space
        self.metadata, self.render_mode = env.metadata, env.render_mode
        self.spec = env.unwrapped.spec


def _function(wrapper: Any) -> Function:
    """Return what a wrapper without memory does to a batch, with a copy of its statistics."""
    if isinstance(wrapper, VecTransposeImage):
        return VecTransposeImage.transpose_image
    if isinstance(wrapper, VecNormalize):
        return copy.deepcopy(wrapper).normalize_obs  # pyright: ignore[reportReturnType] (a Box)
    wrapper_copy: Any = copy.deepcopy(
        wrapper, {id(env): _Spaces(env) for env in _layers(wrapper.env)}
    )
    if hasattr(wrapper_copy, "update_running_mean"):
        wrapper_copy.update_running_mean = False
    return lambda batch: np.stack([wrapper_copy.observation(one) for one in batch])


def _stack(wrapper: VecFrameStack) -> StackedFrames:
    stacked = wrapper.stacked_obs
    dim = -len(stacked.stacked_shape) if stacked.channels_first else -1
    return StackedFrames(N=stacked.n_stack, dim=dim)


def _stacked(wrapper: VecFrameStack, seen: list[NDArray[Any]]) -> list[NDArray[Any]]:
    stacked = wrapper.stacked_obs
    order = "first" if stacked.channels_first else "last"
    stack: Any = StackedObservations(1, stacked.n_stack, stacked.observation_space, order)
    running = np.zeros(1, bool)
    later = (stack.update(one, running, [{}])[0].copy() for one in seen[1:])
    return [stack.reset(seen[0]).copy(), *later]


def _is_color(space: Any) -> bool:
    is_bytes = isinstance(space, spaces.Box) and space.dtype == np.uint8
    return is_bytes and len(space.shape) == 3 and channels_first(space.shape)[0] == 3


def _camera(space: spaces.Box) -> CameraSettings:
    _, height, width = channels_first(space.shape)
    return CameraSettings(height=height, width=width)


def _conditions(world: DroneWorld | DroneWorlds | None) -> dict[str, Any]:
    if world is None:
        return {}
    options = world.batch.options
    if not world.batch.has_images:
        raise InputError(
            "observations=state: the model observes the ground truth instead of images; give a "
            "callable from images to logits"
        )
    return {
        "task": world.batch.task,
        **({"camera": options.camera} if options.inputs is None else {"inputs": options.inputs}),
        "dynamics": options.dynamics,
        "actions": options.actions,
    }
