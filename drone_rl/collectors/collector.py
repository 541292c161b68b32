"""Base class of the collectors of one batch of environments, and threads that run several."""

import abc
import contextvars
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypedDict, cast

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import nn
from torchrl.collectors import BaseCollector
from torchrl.envs import EnvBase

from drone_rl.acceleration import Reasons
from drone_rl.acceleration.fused_episodes import PAID
from drone_rl.envs import base_env
from drone_rl.envs.drone_env import Entries
from drone_rl.envs.rollout import Agent, Step, as_agent
from drone_rl.sim.tasks import ObjectState
from drone_rl.utils.errors import InputError
from drone_rl.utils.threads import set_torch_threads


class BatchOptions(TypedDict, total=False):
    """Keyword arguments of `BatchedCollector`."""

    total_frames: int
    info: Iterable[str]
    postproc: Callable[[TensorDictBase], TensorDictBase] | None


class BatchedCollector(BaseCollector):
    """Iterates over batches from a batched environment and an actor, in this process."""

    fused: Any = Reasons(["collector.compiled is false"])
    """The kernel that takes the steps, or the reasons why they are taken one by one."""

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase | Agent,
        *,
        total_frames: int = -1,
        info: Iterable[str] = (),
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Connect an environment and a policy.

        Args:
            env: A `DroneEnv`, which TorchRL's transforms that change no image may wrap.
            actor: Writes the action; or an agent.
            total_frames: Stop before a batch once this many frames were collected; -1 for never.
            info: Entries of ("next", "info") to keep besides "end_reason"; see `Worlds.entries`.
            postproc: Applied to each batch, such as a return estimator.

        Raises:
            InputError: `env` is another environment, or has no such entry.
        """
        super().__init__()
        self.env, self.base_env = env, base_env(env)
        self.actor: Any = actor
        self.postproc = postproc
        self.total_frames = total_frames
        self.frames = 0
        self.episodes = 0
        self._agent = as_agent(actor)
        self._info = tuple(name for name in info if name != "end_reason")
        if unknown := [name for name in self._info if name not in self.base_env.worlds.entries]:
            raise InputError(
                f"info={unknown[0]} is not known of these drones; choose from "
                f"{', '.join(self.base_env.worlds.entries)}"
            )

    @property
    def name(self) -> str:
        """How steps are taken, for the log."""
        fused = self.fused
        return f"stepping collector: {fused}" if isinstance(fused, Reasons) else "fused collector"

    def _kept_info(self, step: Step) -> Entries:
        """Return the requested entries of ("next", "info") of a step, and `PAID`. (k, *)."""
        worlds, after = self.base_env.worlds, step.after
        every = worlds.info(after) if self._info else {}
        entries: Entries = {("next", "info", name): every[name] for name in self._info}
        if isinstance(after, ObjectState) and len(worlds.task.reward_terms) > 1:
            entries[PAID] = (after.paid * (after.end_reason != 0)[:, None]).float()
        return entries

    @abc.abstractmethod
    def collect(self) -> TensorDictBase:
        """Return the next batch."""

    def iterator(self) -> Iterator[TensorDictBase]:
        """Yield batches until `total_frames`; a `for` over the collector calls it."""
        while self.total_frames < 0 or self.frames < self.total_frames:
            yield self.collect()

    def _finish(self, batch: TensorDictBase, episodes: int) -> TensorDictBase:
        """Count a batch and apply `postproc`."""
        self.frames += batch.numel()
        self.episodes += episodes
        return batch if self.postproc is None else self.postproc(batch)

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Seed the environments, not the actor's generator; return the next seed."""
        return cast(int, self.env.set_seed(seed, static_seed=static_seed))

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """End the kernel's threads, and close the environment unless it is to stay open."""
        if not isinstance(self.fused, Reasons):
            self.fused.close()
        if close_env and not self.env.is_closed:
            self.env.close()

    def __len__(self) -> int:
        """Raise a TypeError: the number of batches is not known."""
        raise TypeError(f"the number of batches of {type(self).__name__} is not known beforehand")

    def _maybe_fallback_update(
        self, policy_or_weights: Any = None, *, model_id: str | None = None
    ) -> None:
        """Copy the weights of an actor, or given ones; called by `update_policy_weights_`."""
        if policy_or_weights is None:
            return
        if isinstance(policy_or_weights, TensorDictBase):
            weights = cast(TensorDictBase, TensorDict.from_module(self.actor))
            weights.data.update_(policy_or_weights.data)
            return
        is_module = isinstance(policy_or_weights, nn.Module)
        self.actor.load_state_dict(
            policy_or_weights.state_dict() if is_module else policy_or_weights
        )


class ThreadedCollector:
    """Join the batches of collectors that run in parallel, each in its own thread.

    Rendering releases the interpreter's lock, so that one collector renders while the policy of
    another acts. Batches are joined in order, so the result does not depend on the threads' speed.
    """

    def __init__(
        self,
        collectors: Sequence[BatchedCollector],
        *,
        num_threads: int = 1,
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Take over collectors of disjoint environments.

        Args:
            collectors: Each has its own thread.
            num_threads: PyTorch's threads that collectors without a fused kernel share.
            postproc: Applied to each joined batch, such as a return estimator.
        """
        self.collectors, self.postproc = list(collectors), postproc
        self.actor = self.collectors[0].actor
        """The policy that learns."""
        count = len(self.collectors)
        is_fused = not isinstance(self.collectors[0].fused, Reasons)
        own = 1 if is_fused else max(1, num_threads // count)
        self._pool = ThreadPoolExecutor(
            count, "collect", initializer=set_torch_threads, initargs=(own,)
        )

    def __iter__(self) -> Iterator[TensorDictBase]:
        """Yield batches without end."""
        while True:
            yield self.collect()

    def collect(self) -> TensorDictBase:
        """Return the batches of the collectors, joined along the first dimension.

        ("collector", "traj_ids") are unique only within the part of one collector.
        """
        contexts = [contextvars.copy_context() for _ in self.collectors]  # as in the calling thread
        parts = list(self._pool.map(lambda c, at: at.run(c.collect), self.collectors, contexts))
        joined: Any = torch.cat  # its annotation lacks TensorDicts
        batch = parts[0] if len(parts) == 1 else joined(parts)
        return batch if self.postproc is None else self.postproc(batch)

    def state_dict(self) -> dict[str, Any]:
        """Return the collectors' states between two batches."""
        return {"collectors": [collector.state_dict() for collector in self.collectors]}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resume from a `state_dict`."""
        for collector, part in zip(self.collectors, state_dict["collectors"], strict=True):
            collector.load_state_dict(part)

    def shutdown(self) -> None:
        """End the threads and close the environments."""
        self._pool.shutdown()
        for collector in self.collectors:
            collector.shutdown()
