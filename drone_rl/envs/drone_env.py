"""The batched TorchRL environment."""

from collections.abc import Iterable, Mapping
from typing import Any, Self

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.data import Binary, Bounded, Categorical, Composite, TensorSpec, Unbounded
from torchrl.envs import Compose, EnvBase, Transform, TransformedEnv

from drone_rl.config import (
    MINIMAL,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.inputs import ImageInput, VectorInput
from drone_rl.envs.observer import Observer, Starts
from drone_rl.envs.transforms import is_of_pixels
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import Dynamics
from drone_rl.sim.rendering import RendererFactory, check_device
from drone_rl.sim.tasks import State, Task, as_task
from drone_rl.sim.visual_randomization import AppearanceSampler
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.available_memory import environment_bytes, require_memory
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Text, Whole
from drone_rl.utils.seeding import Stream, get_state, set_state, side_stream, world_random_state

Entries = dict[NestedKey, Tensor]
"""Entries of a TensorDict."""


class DroneEnv(EnvBase):
    """`num_envs` independent drones, stepped and rendered as one batch.

    Observations: the inputs by name, as its `observer` makes them; by default "pixels", without
    transforms uint8, shape (num_envs, height, width, 3). The action space is that of the dynamics.
    The nested "info" is the ground truth, see `Worlds.entries`.

    Partial resets and steps (TorchRL's masks "_reset" and "_step") leave the other environments
    alone and repeat their last images. Environment i samples its episodes from its own random
    stream, so that the first k environments do not depend on the batch size.
    """

    def __init__(
        self,
        num_envs: int,
        task: BaseTaskSettings | Task[Any] | str | None = None,
        camera: CameraSettings | None = None,
        *,
        transforms: Iterable[Transform] = (),
        inputs: Mapping[str, ImageInput | VectorInput] | None = None,
        seed: int = 0,
        stream: Stream = Stream.WORLDS,
        first_world: int = 0,
        num_shards: int | None = None,
        pixels: bool = True,
        device: str = "cpu",
        dynamics: Dynamics | DynamicsSettings | None = None,
        actions: ActionSettings | None = None,
        renderer: str | RendererFactory = "raytrace",
        appearance: AppearanceSettings | None = None,
    ) -> None:
        """Create the environments.

        Args:
            num_envs: Batch size.
            task: A task, its settings or its name; cube collection by default.
            camera: The policy's camera.
            transforms: From the camera's images to "pixels", in order.
            inputs: The inputs by name, instead of "pixels".
            seed: Root of the environments' random streams.
            stream: Purpose of the environments; training and evaluation use different streams.
            first_world: Number of the first environment, so that workers use different streams.
            num_shards: Threads that render on the CPU; the number of cores by default.
            pixels: Whether to render; policies that read the ground truth don't need it.
            device: "cpu", "cuda" or "cuda:N".
            dynamics: Vehicle dynamics; the task's default if None.
            actions: Action space, if `dynamics` are settings; the moves by default.
            renderer: See `drone_rl.sim.rendering.find_renderer`.
            appearance: Visual appearance; ranges are sampled at every reset.

        Raises:
            InputError: A setting is out of range, a texture can't be read, there is no room for
                the camera or for distractors, there is too little memory, or `actions` are given
                with dynamics that have some.
        """
        Whole(1).read(num_envs, "num_envs")
        device = Text().read(device, "device")  # torch's, too
        check_device(device)
        if device == "cpu":
            image = camera or CameraSettings()
            size = image.height * image.width if pixels else 0
            kind = renderer if isinstance(renderer, str) else ""
            needed = num_envs * environment_bytes(size, kind)
            require_memory(needed, f"num_envs={num_envs}", "give fewer environments")
        super().__init__(device=torch.device(device), batch_size=torch.Size([num_envs]))
        task = as_task(task)
        self.appearances = AppearanceSampler(
            appearance or MINIMAL, num_envs, device, task=task, camera=camera
        )
        self.worlds = Worlds(
            num_envs,
            task,
            camera,
            dynamics=dynamics,
            actions=actions,
            renderer=renderer,
            device=device,
            num_shards=num_shards,
            appearance=self.appearances.middle,
            distractors=self.appearances.distractors,
        )
        self.pixels = pixels
        self.observer = Observer(
            self.worlds,
            transforms if inputs is None else inputs,
            appearance=self.appearances.current,
            streams=lambda rows, key: self.side_streams(rows, *key),
        )
        """Makes the inputs of policies."""
        if pixels:
            for image in self.observer.images.values():
                self.worlds.prepare(image.view)
        self.stream = stream
        self.first_world = first_world
        self._make_specs()
        self._seen: dict[str, Tensor] = {}
        if pixels:
            names = self.observer.sources
            self._seen = {name: self.observation_spec[name].zero() for name in names}
        self.set_seed(seed)
        self.is_closed = False  # TorchRL's default is True

    def state_dict(self, *args: object, **kwargs: object) -> dict:
        """Return the random streams, which suffice if every environment is reset next.

        They are joined by the state of the task's curriculum, if it has one.
        """
        states = {"random_states": [get_state(r) for r in self.random_states]}
        curriculum = self.worlds.task.curriculum
        return states if curriculum is None else {**states, "curriculum": curriculum.state()}

    def load_state_dict(  # pyright: ignore[reportIncompatibleMethodOverride] (as EnvBase)
        self, state_dict: dict, strict: bool = True, assign: bool = False
    ) -> None:
        """Restore a `state_dict` of as many environments, else raise an `InputError`."""
        states = state_dict["random_states"]
        if len(states) != len(self.random_states):
            raise InputError(
                f"the saved state has {len(states)} environments, this batch "
                f"{len(self.random_states)}; set num_envs={len(states)}"
            )
        for random_state, state in zip(self.random_states, states, strict=True):
            set_state(random_state, state)
        if self.worlds.task.curriculum is not None:
            self.worlds.task.curriculum.load(state_dict["curriculum"])

    def running_state(self) -> dict[str, Any]:
        """Return the full state, which suffices to resume within episodes."""
        appearances = {"looks": self.appearances.values} if self.appearances.varies else {}
        memory = {"observer": self.observer.state_dict()}
        return {**self.state_dict(), "worlds": self.worlds.state.tensors(), **appearances, **memory}

    def load_running_state(self, state: Mapping[str, Any]) -> None:
        """Restore a `running_state` and render it; see `load_state_dict` for errors."""
        self.load_state_dict(dict(state))
        self.worlds.state = self.worlds.state.with_tensors(state["worlds"])
        if self.appearances.varies:
            self.appearances.load(state["looks"])
        self.observer.load_state_dict(state["observer"])
        self.observe(self._indices(None), None)

    def side_streams(self, env_ids: Tensor, *key: int) -> list[np.random.Generator]:
        """Return further random streams of episodes that have just begun, for the purpose `key`.

        They leave the task's own streams unchanged. `env_ids` are indices, (k,).
        """
        return [side_stream(self.random_states[i], *key) for i in env_ids.tolist()]

    @property
    def base_env(self) -> Self:
        """Itself, as TorchRL's `TransformedEnv.base_env`."""
        return self

    @property
    def last_pixels(self) -> Tensor:
        """The camera's images of the present states. Shape: (num_envs, H, W, 3), uint8."""
        return self.worlds.render(self.worlds.state, appearance=self.appearances.current())

    def close(self, *, raise_if_closed: bool = True) -> None:
        """Stop the rendering threads."""
        if not self.is_closed:
            self.worlds.close()
        super().close(raise_if_closed=raise_if_closed)

    def to(self, device: torch.device | str) -> Self:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the environment itself; raise an `InputError` for another device."""
        target, source = torch.device(device), self.device or torch.device("cpu")
        if target.type != source.type or len({target.index, source.index} - {None}) > 1:
            raise InputError(
                f"a DroneEnv on {source} can't move to {target}; make it with "
                f"device={str(target)!r} or give TorchRL's collector env_device={str(source)!r}"
            )
        return self

    def _make_specs(self) -> None:
        n = self.batch_size[0]
        entries = {name: _spec(entry, n) for name, entry in self.worlds.entries.items()}
        info = Composite(entries, shape=(n,))
        inputs = self._input_specs() if self.pixels else {}
        observed = {**inputs, "info": info}
        self.observation_spec = Composite(observed, shape=(n,)).to(self.device)
        self.action_spec = make_action_spec(self.worlds.dynamics.actions.entry, n).to(self.device)
        self.reward_spec = Unbounded(torch.Size((n, 1))).to(self.device)
        done = {name: Binary(1, torch.Size((n, 1)), dtype=torch.bool) for name in _DONE_KEYS}
        self.full_done_spec = Composite(done, shape=(n,)).to(self.device)

    def _input_specs(self) -> dict[str, TensorSpec]:
        specs: dict[str, TensorSpec] = {}
        for name, example in self.observer.examples().items():
            shape = torch.Size((self.batch_size[0], *example.shape[1:]))
            if example.dtype == torch.uint8:
                specs[name] = Bounded(0, 255, shape, dtype=torch.uint8, device=self.device)
            else:
                specs[name] = Unbounded(shape, dtype=example.dtype, device=self.device)
        return specs

    def _set_seed(self, seed: int | None) -> None:
        if seed is None:
            raise InputError("seed=None is not reproducible; give a whole number, 0 or more")
        first, n = self.first_world, self.batch_size[0]
        self.random_states = [world_random_state(seed, first + i, self.stream) for i in range(n)]
        """The random stream of each environment's episodes."""

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: object) -> TensorDictBase:
        if "seed" in kwargs:
            raise InputError("reset can't take a seed; call env.set_seed(seed) before it")
        mask = None if tensordict is None else tensordict.get("_reset", None)
        env_ids = self._indices(mask)
        self.start(env_ids)
        self.observe(env_ids, True)
        running = torch.zeros(*self.batch_size, 1, dtype=torch.bool, device=self.device)
        return self._entries({name: running.clone() for name in _DONE_KEYS})

    def start(self, env_ids: Tensor | None = None) -> State:
        """Start episodes, by default all, without rendering; return their states. Indices: (k,)."""
        env_ids = self._indices(None) if env_ids is None else env_ids
        random_states = [self.random_states[i] for i in env_ids.tolist()]
        self.appearances.reset(env_ids, random_states)
        self.worlds.reset(env_ids, random_states)
        return self.worlds.state[env_ids]

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        env_ids = self._indices(tensordict.get("_step", None))
        reward = torch.zeros(*self.batch_size, 1, device=self.device)
        action = tensordict.get(self.action_key, None)
        if action is None:
            raise InputError(f"there is no entry {self.action_key!r}; give one of env.action_spec")
        if action.shape != self.action_spec.shape:
            raise InputError(
                f"actions have the shape {tuple(action.shape)}; give {self.action_spec.shape}, as "
                "env.action_spec says"
            )
        taken = action[env_ids]
        self._check_range(taken)
        reward[env_ids, 0] = self.worlds.step(env_ids, taken).float()
        self.observe(env_ids, False)
        return self._entries({"reward": reward, **self.flags(self.worlds.state.end_reason)})

    def flags(self, end_reason: Tensor) -> dict[str, Tensor]:
        """Return "done", "terminated" and "truncated" of states. Shapes: (k,) to (k, 1)."""
        terminated, truncated = (flag[:, None] for flag in self.worlds.ends(end_reason))
        return {"done": terminated | truncated, "terminated": terminated, "truncated": truncated}

    def outcome(self, end_reason: Tensor, reward: Tensor) -> Entries:
        """Return the ("next", ...) entries of any step: reward, flags, and "end_reason" of "info".

        Shapes: (k,) to (k, 1).
        """
        entries: Entries = {("next", name): flag for name, flag in self.flags(end_reason).items()}
        reason = {("next", "info", "end_reason"): end_reason[:, None]}
        return {("next", "reward"): reward.float()[:, None], **entries, **reason}

    def _check_range(self, action: Tensor) -> None:
        """Raise an `InputError` for indices of actions that there are not."""
        space: Any = self.action_spec.space
        if not hasattr(space, "n") or not len(action):
            return
        if action.is_floating_point():
            raise InputError("actions are numbers with a point; give indices of env.action_spec")
        count, low, high = space.n, int(action.min()), int(action.max())
        if low < 0 or high >= count:
            raise InputError(
                f"actions from {low} to {high} are not all in 0 to {count - 1}; give indices of "
                "env.action_spec"
            )

    def observe(self, env_ids: Tensor, starts: Starts) -> dict[str, Tensor]:
        """Observe environments, (k,), once after each step and reset; see `Observer.observe`.

        Returns the inputs of all; those of the others are as they were.
        """
        if self.pixels and len(env_ids):
            is_whole = len(env_ids) == self.worlds.num_envs
            state = self.worlds.state if is_whole else self.worlds.state[env_ids]
            look = self.appearances.current(env_ids)
            for name, values in self.observer.observe(state, env_ids, starts, look).items():
                before = self._seen[name]
                self._seen[name] = values if is_whole else before.index_copy(0, env_ids, values)
        return self._seen

    def _entries(self, entries: dict[str, Any]) -> TensorDict:
        info = TensorDict(self.worlds.info(), self.batch_size, device=self.device)
        entries = {**self._seen, "info": info, **entries}
        return TensorDict(entries, self.batch_size, device=self.device)

    def _indices(self, mask: Tensor | None) -> Tensor:
        if mask is None:
            return torch.arange(self.batch_size[0], device=self.device)
        return mask.reshape(self.batch_size).nonzero()[:, 0]


_DONE_KEYS = ("done", "terminated", "truncated")


def base_env(env: EnvBase) -> DroneEnv:
    """Return the `DroneEnv` below TorchRL's transforms.

    Raises:
        InputError: There is none, or a transform of TorchRL changes its images.
    """
    base: Any = env.base_env if isinstance(env, TransformedEnv) else env
    if not isinstance(base, DroneEnv):
        raise InputError(f"env is a {type(base).__name__}; give drone_rl.make_env(...)")
    transforms: Any = env.transform if isinstance(env, TransformedEnv) else ()
    if changing := [type(t).__name__ for t in _parts(transforms) if is_of_pixels(t)]:
        raise InputError(
            f"env has {changing[0]} in a TransformedEnv; give transforms of images to "
            "make_env(transforms=...) or DroneEnv(transforms=...)"
        )
    return base


def with_others(env: DroneEnv, transforms: Iterable[Transform]) -> EnvBase:
    """Wrap an environment with the transforms that do not change images, if there are any."""
    others = [transform for transform in transforms if not is_of_pixels(transform)]
    # TorchRL annotates the star of its arguments as a list
    return TransformedEnv(env, Compose(*others)) if others else env  # pyright: ignore[reportArgumentType]


def _parts(transforms: Any) -> Iterable[Transform]:
    return transforms if isinstance(transforms, Compose | tuple) else (transforms,)


def worlds_of(env: EnvBase) -> Worlds:
    """Return the worlds of an environment, with or without transforms."""
    return base_env(env).worlds


def make_action_spec(entry: Entry, num_envs: int = 1) -> TensorSpec:
    """Return the batched spec of an action; whole numbers are indices of discrete actions."""
    if entry.dtype == torch.int64 and entry.high is not None:
        shape = torch.Size((num_envs, *entry.shape))
        return Categorical(int(entry.high) + 1, shape=shape, dtype=torch.int64)
    return _spec(entry, num_envs)


def _spec(entry: Entry, num_envs: int) -> TensorSpec:
    """Return the batched spec of an entry."""
    shape = torch.Size((num_envs, *entry.shape))
    if entry.dtype == torch.bool:
        return Binary(shape[-1], shape, dtype=torch.bool)
    if entry.low is None or entry.high is None:
        return Unbounded(shape, dtype=entry.dtype)
    return Bounded(entry.low, entry.high, shape, dtype=entry.dtype)
