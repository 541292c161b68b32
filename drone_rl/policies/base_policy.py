"""Base class of policies that can be evaluated and explained: from a file, or third-party."""

import abc
import contextlib
from collections.abc import Iterator
from typing import Any, Self

import torch
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase, TransformedEnv

from drone_rl.config import ActionSettings, BaseTaskSettings, DynamicsSettings
from drone_rl.policies import PictureNetwork, make_actor
from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown
from drone_rl.utils.seeding import Stream, torch_generator


class Pilot(abc.ABC):
    """A policy with its observations, task and dynamics."""

    name: str
    """For people."""

    @property
    @abc.abstractmethod
    def task(self) -> BaseTaskSettings | Task[Any]:
        """The task."""

    @property
    @abc.abstractmethod
    def dynamics(self) -> DynamicsSettings:
        """How its drone moves."""

    @property
    @abc.abstractmethod
    def actions(self) -> ActionSettings:
        """What its outputs mean."""

    @property
    @abc.abstractmethod
    def own_dynamics(self) -> DynamicsSettings:
        """Dynamics of its training."""

    @property
    def unlike(self) -> dict[str, dict[str, Any]]:
        """Settings of `dynamics` that differ from its own: "own" and "flown" values by name."""
        own, flown = self.own_dynamics.values(), self.dynamics.values()
        if self.dynamics.is_computer_vision:  # where nothing else counts
            own, flown = ({"mode": of["mode"]} for of in (own, flown))
        return {n: {"own": own[n], "flown": v} for n, v in flown.items() if own[n] != v}

    @property
    @abc.abstractmethod
    def origin(self) -> dict[str, Any]:
        """Its origin, as plain values: "policy", and how it was "trained", if known."""

    @abc.abstractmethod
    def in_task(self, **changes: Any) -> Self:
        """Return the same policy in a changed task, such as `policy.in_task(num_cubes=5)`.

        Raises:
            InputError: A setting is unknown or out of range; the message begins with "task.".
        """

    @abc.abstractmethod
    def in_dynamics(self, **changes: Any) -> Self:
        """Return the same policy with other dynamics: `policy.in_dynamics(mode="simple_flight")`.

        Raises:
            InputError: A setting is unknown or out of range; the message begins with "dynamics.".
        """

    def make_env(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
        **kwargs: Any,
    ) -> TransformedEnv:
        """Return environments like those of its training, with its camera and transforms.

        Args:
            num_envs: How many.
            seed: Root of their random streams.
            stream: Which environments: by default those to report on, which training never sees.
            device: Where they are rendered.
            kwargs: See `drone_rl.envs.DroneEnv`.
        """
        options = {"seed": seed, "stream": stream, "device": device, **kwargs}
        return self._make_env(num_envs, options)

    @abc.abstractmethod
    def _make_env(self, num_envs: int, options: dict[str, Any]) -> TransformedEnv: ...

    @abc.abstractmethod
    def make_network(self, device: str | torch.device = "cpu") -> PictureNetwork:
        """Return its network."""

    def make_actor(
        self, env: EnvBase | None = None, *, seed: int = 0, stream: Stream = Stream.REPORT
    ) -> TensorDictModuleBase:
        """Return a TorchRL actor, which samples its actions from a stream of its own.

        Args:
            env: From `make_env`: its device and actions are used; those of a CPU by default.
            seed: Root of the stream.
            stream: Purpose of the stream.

        Raises:
            InputError: The environment is not one of TorchRL's.
        """
        if env is None:
            own = self.make_env(1, pixels=False)
            own.close()
            return self.make_actor(own, seed=seed, stream=stream)
        if not isinstance(env, EnvBase):
            raise InputError(f"env={shown(env)} is no TorchRL environment; give policy.make_env(n)")
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
        **kwargs: Any,
    ) -> Iterator[tuple[TransformedEnv, TensorDictModuleBase]]:
        """Yield environments and its actor; close them afterwards. See `make_env`."""
        env = self.make_env(num_envs, seed=seed, stream=stream, device=device, **kwargs)
        try:
            yield env, self.make_actor(env, seed=seed, stream=stream)
        finally:
            env.close()
