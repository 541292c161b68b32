"""Policies with their task, observations and dynamics: the base class, and policies from files."""

import abc
import contextlib
import dataclasses
import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self, Unpack

import numpy as np
import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.config import (
    MOVES_SETTINGS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    DynamicsSettings,
)
from drone_rl.config.configuration import changed
from drone_rl.config.inputs import PIXELS, ImageInput, VectorInput
from drone_rl.envs.readings import Readings
from drone_rl.policies import ImageNetwork, RecurrentNetwork, make_actor
from drone_rl.policies.environment import EnvOptions
from drone_rl.policies.recurrent import Memory
from drone_rl.policies.zoo import PolicyDescription, SavedPolicy, find_policy, read_policy
from drone_rl.policies.zoo.description import scenes_of
from drone_rl.sim.rendering.devices import check_defaults
from drone_rl.sim.tasks import Task
from drone_rl.utils.display import table
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance, shown
from drone_rl.utils.seeding import Stream, torch_generator
from drone_rl.utils.settings import prefixed_errors


class BasePolicy(abc.ABC):
    """A policy with its observations, task and dynamics."""

    name: str
    """Name in reports."""

    @property
    @abc.abstractmethod
    def task(self) -> BaseTaskSettings | Task[Any]:
        """The task."""

    @property
    @abc.abstractmethod
    def dynamics(self) -> DynamicsSettings:
        """The vehicle dynamics."""

    @property
    @abc.abstractmethod
    def actions(self) -> ActionSettings:
        """The action space."""

    @property
    @abc.abstractmethod
    def own_dynamics(self) -> DynamicsSettings:
        """The vehicle dynamics in training."""

    @property
    @abc.abstractmethod
    def appearance(self) -> AppearanceSettings:
        """The appearance of the scenes."""

    @property
    @abc.abstractmethod
    def own_appearance(self) -> AppearanceSettings:
        """The appearance of the scenes in training."""

    @property
    def unlike(self) -> dict[str, dict[str, Any]]:
        """Settings that differ from those in training: "own" and "flown" values by name.

        Names are of `dynamics`, or "appearance.NAME".
        """
        names = self.dynamics.effective(self.actions.kind)

        def values(dynamics: DynamicsSettings, look: AppearanceSettings) -> dict[str, Any]:
            looks = {f"appearance.{name}": value for name, value in look.values().items()}
            return {name: dynamics.values()[name] for name in names} | looks

        trained = values(self.own_dynamics, self.own_appearance)
        flown = values(self.dynamics, self.appearance)
        return {n: {"own": trained[n], "flown": v} for n, v in flown.items() if trained[n] != v}

    @property
    def known_scenes(self) -> tuple[str, ...]:
        """The scene files of the training, if it flies in no other ones, by their content."""
        return ()

    @abc.abstractmethod
    def in_appearance(self, appearance: AppearanceSettings | str) -> Self:
        """Return the same policy in scenes of another appearance, which may be a name.

        Raises:
            InputError: There is no appearance of this name.
        """

    @property
    @abc.abstractmethod
    def source(self) -> str:
        """Its file, or else its name."""

    @property
    def trained(self) -> dict[str, Any] | None:
        """How it was trained, as plain values; None if unknown."""
        return None

    @abc.abstractmethod
    def in_task(self, task: Mapping[str, Any] | None = None, /, **changes: Any) -> Self:
        """Return the same policy in a changed task, such as `policy.in_task(num_cubes=5)`.

        The changes may also be a mapping, or settings of the same task.

        Raises:
            InputError: A setting is unknown or out of range.
        """

    @abc.abstractmethod
    def in_dynamics(self, dynamics: Mapping[str, Any] | None = None, /, **changes: Any) -> Self:
        """Return the same policy with other dynamics: `policy.in_dynamics(mode="simple_flight")`.

        The changes may also be a mapping, or settings.

        Raises:
            InputError: A setting is unknown or out of range.
        """

    @abc.abstractmethod
    def make_env(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
        **options: Unpack[EnvOptions],
    ) -> EnvBase:
        """Return environments like those of its training, with its camera and transforms.

        The default `stream` has the environments to report on, which training never sees.
        """

    @abc.abstractmethod
    def make_network(self, device: str | torch.device = "cpu") -> ImageNetwork:
        """Return its network."""

    def make_actor(
        self, env: EnvBase | None = None, *, seed: int = 0, stream: Stream = Stream.REPORT
    ) -> TensorDictModuleBase:
        """Return a TorchRL actor, which samples its actions from the stream of `seed` and `stream`.

        It has the device and action space of `env`, from `make_env`; by default the CPU and its own
        action space.

        Raises:
            InputError: The environment is not one of TorchRL's.
        """
        if env is None:
            blind_env = self.make_env(1, pixels=False)
            blind_env.close()
            return self.make_actor(blind_env, seed=seed, stream=stream)
        if not isinstance(env, EnvBase):
            raise InputError(f"env={shown(env)} is not a TorchRL environment; use policy.make_env")
        device = str(env.device or "cpu")
        generator = torch_generator(seed, stream, device=device)
        return make_actor(self.make_network(device), env.action_spec, generator)

    @contextlib.contextmanager
    def flying(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
        **options: Unpack[EnvOptions],
    ) -> Iterator[tuple[EnvBase, TensorDictModuleBase]]:
        """Yield environments and its actor; close them afterwards. See `make_env`."""
        env = self.make_env(num_envs, seed=seed, stream=stream, device=device, **options)
        try:
            yield env, self.make_actor(env, seed=seed, stream=stream)
        finally:
            env.close()


@dataclasses.dataclass(frozen=True, eq=False)
class Policy(BasePolicy):
    """A trained policy: its task, camera and transforms, network and provenance.

    Policies are equal only if they are the same object: their state holds tensors.
    """

    name: str
    """Name in the zoo, of the run's folder, or of its file; see `load_policy`."""
    path: Path
    """Its file."""
    description: PolicyDescription = dataclasses.field(repr=False)
    """Task, camera, transforms and network."""
    state: SavedPolicy = dataclasses.field(repr=False)
    """Content of its file."""
    _memory: list[Memory] = dataclasses.field(
        default_factory=list, init=False, repr=False, compare=False
    )
    """State of a recurrent network after the last call of `act_batch`; empty at first."""

    @property
    def task(self) -> BaseTaskSettings:
        """The task."""
        return self.description.task.parameters

    @property
    def dynamics(self) -> DynamicsSettings:
        """The vehicle dynamics."""
        return self.description.dynamics

    @property
    def actions(self) -> ActionSettings:
        """The action space."""
        return self.description.actions.settings

    @property
    def own_dynamics(self) -> DynamicsSettings:
        """The vehicle dynamics in training."""
        return self.state.description.dynamics

    @property
    def appearance(self) -> AppearanceSettings:
        """The appearance of the scenes."""
        return self.description.appearance

    @property
    def own_appearance(self) -> AppearanceSettings:
        """The appearance of the scenes in training."""
        return self.state.description.appearance

    @property
    def unlike(self) -> dict[str, dict[str, Any]]:
        """See `BasePolicy.unlike`; also "task.scene"."""
        tasks = {"own": self.state.description.task.parameters, "flown": self.task}
        scenes = {name: getattr(task, "scene", None) for name, task in tasks.items()}
        is_other = scenes["own"] != scenes["flown"]
        return super().unlike | ({"task.scene": scenes} if is_other else {})

    @property
    def known_scenes(self) -> tuple[str, ...]:
        """See `BasePolicy.known_scenes`."""
        own, now = self.state.description.task, scenes_of(self.task) or ()
        known = {scene.hash for scene in own.scene or ()}
        is_known = bool(now) and all(scene.hash in known for scene in now)
        return tuple(getattr(own.parameters, "scene", ())) if is_known else ()

    @property
    def source(self) -> str:
        """Its file."""
        return str(self.path)

    @property
    def trained(self) -> dict[str, Any]:
        """Description, progress, provenance and command of the training."""
        names = {"description", "progress", "provenance", "command"}
        return self.state.model_dump(mode="json", include=names)

    def in_task(self, task: Mapping[str, Any] | None = None, /, **changes: Any) -> "Policy":
        """See `BasePolicy`."""
        changed_task = changed(self.task, task, changes, "task")
        with prefixed_errors("task"):
            described = self.description.task.changed(changed_task)
        return self._described(task=described)

    def in_dynamics(self, dynamics: Mapping[str, Any] | None = None, /, **changes: Any) -> "Policy":
        """See `BasePolicy`."""
        return self._described(dynamics=changed(self.dynamics, dynamics, changes, "dynamics"))

    def in_appearance(self, appearance: AppearanceSettings | str) -> "Policy":
        """Return the same policy in scenes of another appearance, which may be a name."""
        appearance = Instance(AppearanceSettings).read(appearance, "appearance")
        return self._described(appearance=appearance)

    def _described(self, **changes: Any) -> "Policy":
        return dataclasses.replace(self, description=self.description.replace(**changes))

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
        return self.description.build_env(
            num_envs, seed=seed, stream=stream, device=device, **options
        )

    def make_network(self, device: str | torch.device = "cpu") -> ImageNetwork:
        """Return its network."""
        network = self.description.load_network(self.state.weights).to(device)
        network.owner = f"policy={self.name}"
        return network

    def act(
        self, image: np.ndarray | Tensor | None = None, /, **inputs: np.ndarray | Tensor
    ) -> int | np.ndarray:
        """Return the greedy action for one reading of each camera and sensor, see `act_batch`.

        Args:
            image: The input of a policy that has a single one. Shape: (H, W, 3).
            inputs: The inputs by name, as in `act_batch`, without the first dimension.

        Returns:
            The index of the action, or the values of a continuous one.

        Raises:
            InputError: See `act_batch`.
        """
        action = self._act(image, inputs, single=True)[0].numpy()
        return action if action.ndim else int(action)

    def act_batch(
        self, images: np.ndarray | Tensor | None = None, /, **inputs: np.ndarray | Tensor
    ) -> Tensor:
        """Return the greedy actions of several drones.

        Images pass through the policy's transforms, without simulated errors. If it stacks frames
        or is recurrent, it remembers the images of earlier calls, until `reset`.

        Args:
            images: The input of a policy that has a single one. Shape: (N, H, W, 3).
            inputs: The inputs by name, as cameras and sensors give them: RGB, uint8
                (N, H, W, 3), depth in metres (N, H, W), vectors in SI units (N, n); see
                `drone_rl.envs.readings`.

        Returns:
            The index of each action, or the values of continuous ones. Shape: (N, ...).

        Raises:
            InputError: An input is missing or unknown, or does not fit the policy or the last call.
        """
        return self._act(images, inputs, single=False)

    @torch.no_grad()
    def _act(self, image: Any, inputs: Mapping[str, Any], *, single: bool) -> Tensor:
        network, reader = self._network_and_readings
        if image is not None:
            if len(reader.inputs) > 1:
                raise InputError(f"the policy reads {', '.join(reader.inputs)}; give them by name")
            inputs = {**dict.fromkeys(reader.inputs, image), **inputs}
        readings = reader.read(inputs, single=single)
        count = len(next(iter(readings.values())))
        memories = reader.memories
        remembered = [*memories, *(memory.hidden for memory in self._memory)]
        if remembered and len(remembered[0]) != count:
            raise InputError(
                f"{count} images follow {len(remembered[0])}; call reset() before images of "
                "another number of drones"
            )
        seen = reader(readings, starts=not memories)
        if isinstance(network, RecurrentNetwork):
            memory = self._memory[0] if self._memory else network.start(count)
            outputs, memory = network.step(seen[PIXELS], memory)
            self._memory[:] = [memory]
        else:
            outputs = network(*(seen[name] for name in network.in_keys))
        return network.actions.greedy(outputs)

    def reset(self) -> None:
        """Forget the images of earlier calls of `act` and `act_batch`, before a new episode."""
        self._memory.clear()
        self._network_and_readings[1].forget()

    @functools.cached_property
    def _network_and_readings(self) -> tuple[ImageNetwork, Readings]:
        return self.make_network(), Readings(self.description.inputs)

    def _repr_html_(self) -> str:
        progress, described = self.state.progress, self.description
        parts = {"network": described.network, "task": self.task}
        parts |= {} if self.dynamics.is_computer_vision else {"dynamics": self.dynamics}
        parts |= {} if self.actions == MOVES_SETTINGS else {"actions": self.actions}
        rows = {
            **{
                name: ", ".join(f"{k}={v}" for k, v in part.model_dump().items())
                for name, part in parts.items()
            },
            "sees": _text_of(described.inputs),
            "trained": f"{progress.frames:,} frames, {progress.episodes:,} episodes",
            "file": str(self.path),
        }
        return table(["policy", self.name], [[name, text] for name, text in rows.items()])


def _text_of(inputs: Mapping[str, ImageInput | VectorInput]) -> str:
    """Return names and transforms of inputs."""
    parts = []
    for name, seen in inputs.items():
        steps = [step.name for step in getattr(seen, "transforms", ())]
        parts.append(" > ".join(steps if name == PIXELS else [name, *steps]))
    return ", ".join(parts)


def load_policy(which: str | Path | Policy, *, outputs: str | Path = "outputs") -> Policy:
    """Load a trained policy.

    Args:
        which: The name of a shipped policy such as "good" or "proved", a .pt or .safetensors file,
            the folder of a run (its `last.pt`), or "latest" for the newest. A policy is returned.
        outputs: Folder of the runs.

    Raises:
        InputError: There is none, or it is unusable.
    """
    check_defaults()
    if isinstance(which, Policy):
        return which
    if not isinstance(which, str | Path):
        name = getattr(which, "name", shown(which))
        raise InputError(
            f"policy={name} is in no file of drone_rl's, which this function needs (judge, "
            "evaluate, explain and shifts do not); give the name or path of a trained policy"
        )
    path = find_policy(which, outputs)
    state = read_policy(path)
    return Policy(_name_of(path.absolute()), path, state.description, state)


def _name_of(path: Path) -> str:
    """Return the run's name for its `last.pt`, with the file's name for another checkpoint."""
    if path.suffix != ".pt" or path.parent.name != "checkpoints":
        return path.stem
    run = path.parents[1].name
    return run if path.stem == "last" else f"{run}_{path.stem}"
