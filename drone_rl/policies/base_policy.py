"""Whoever can be flown, judged and explained: a policy out of a file, or one made elsewhere."""

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
    """A policy, with what it sees and what it flies in."""

    name: str
    """For people."""

    @property
    @abc.abstractmethod
    def task(self) -> BaseTaskSettings | Task[Any]:
        """What it flies in."""

    @property
    @abc.abstractmethod
    def dynamics(self) -> DynamicsSettings:
        """How its drone moves."""

    @property
    @abc.abstractmethod
    def actions(self) -> ActionSettings:
        """What it can ask for."""

    @property
    @abc.abstractmethod
    def own_dynamics(self) -> DynamicsSettings:
        """How its drone moved when it was made."""

    @property
    def unlike(self) -> dict[str, dict[str, Any]]:
        """By what `dynamics` differ from its own: setting to "own" and "flown", plain values."""
        own, flown = self.own_dynamics.values(), self.dynamics.values()
        if self.dynamics.is_computer_vision:  # where nothing else counts
            own, flown = ({"mode": of["mode"]} for of in (own, flown))
        return {n: {"own": own[n], "flown": v} for n, v in flown.items() if own[n] != v}

    @property
    @abc.abstractmethod
    def origin(self) -> dict[str, Any]:
        """Where it comes from, as plain values: "policy", and how it was "trained", if known."""

    @abc.abstractmethod
    def in_task(self, **changes: Any) -> Self:
        """The same policy in a changed task, such as `policy.in_task(num_cubes=5)`.

        Args:
            changes: Settings of the task; None keeps its own.

        Raises:
            InputError: A setting is unknown or out of range; the message begins with "task.".
        """

    @abc.abstractmethod
    def in_dynamics(self, **changes: Any) -> Self:
        """The same policy in another body or air, as `policy.in_dynamics(mode="simple_flight")`.

        Args:
            changes: Settings of the dynamics; None keeps its own.

        Raises:
            InputError: A setting is unknown or out of range; the message begins with "dynamics.".
        """

    @abc.abstractmethod
    def make_env(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
        **kwargs: Any,
    ) -> TransformedEnv:
        """Worlds like those that it was trained in, seen as it sees them.

        Args:
            num_envs: How many.
            seed: Root of their random streams.
            stream: Which worlds: by default those to report on, which training never sees.
            device: Where they are drawn.
            kwargs: See `drone_rl.envs.DroneEnv`.
        """

    @abc.abstractmethod
    def make_network(self, device: str | torch.device = "cpu") -> PictureNetwork:
        """Its network."""

    def make_actor(
        self, env: EnvBase | None = None, *, seed: int = 0, stream: Stream = Stream.REPORT
    ) -> TensorDictModuleBase:
        """Return a TorchRL actor, which samples its actions from a stream of its own.

        Args:
            env: From `make_env`, for whose device and actions the actor is made; by default for
                those that `make_env` gives on a CPU.
            seed: Of the stream.
            stream: Which.

        Raises:
            InputError: The environment is none of TorchRL's.
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
        """Worlds and it as their actor, for a while; then the worlds are closed.

        Args:
            num_envs: How many.
            seed: Root of their random streams and of its own.
            stream: Which worlds.
            device: Where they are drawn.
            kwargs: See `drone_rl.envs.DroneEnv`.
        """
        env = self.make_env(num_envs, seed=seed, stream=stream, device=device, **kwargs)
        try:
            yield env, self.make_actor(env, seed=seed, stream=stream)
        finally:
            env.close()
