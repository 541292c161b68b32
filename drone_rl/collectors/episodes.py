"""Collects complete episodes from a batch of environments."""

from collections.abc import Iterable
from typing import Any, Unpack

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.acceleration import FusedEpisodes, Reasons
from drone_rl.acceleration.fused_episodes import END_REASON, EPISODE, REWARD
from drone_rl.collectors.collector import BatchedCollector, BatchOptions
from drone_rl.envs.drone_env import Entries
from drone_rl.envs.rollout import Act, Agent, StepContext, steps
from drone_rl.sim.tasks import State


class EpisodeCollector(BatchedCollector):
    """Iterate over batches of `env.batch_size[0]` complete episodes, one for each environment.

    A batch is in the "cat" format of TorchRL's `Collector(trajs_per_batch=...)`: a flat TensorDict
    of shape (T_total,), episode after episode without padding, numbered by ("collector",
    "traj_ids"), each ending in ("next", "done"). Next observations are left out: only
    estimators with a critic need them.

    All environments reset at the start of a batch. An environment whose episode has ended is
    neither stepped nor rendered until the batch ends. So a batch is on-policy and not biased
    towards short episodes, and between batches the environments' random streams are the whole
    state.
    """

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase | Agent,
        *,
        keep_actor_entries: bool = True,
        actor_keys: Iterable[NestedKey] = (),
        compiled: bool = False,
        num_threads: int = 1,
        **options: Unpack[BatchOptions],
    ) -> None:
        """Connect an environment and a policy.

        Args:
            env: A batch of environments.
            actor: Writes the action; or an agent.
            keep_actor_entries: Whether to keep all entries that the actor reads and writes.
            actor_keys: Entries that the actor reads or writes, to keep in addition to the action.
            compiled: Whether one kernel runs the episodes, if it supports them; sampling and sums
                are in another order.
            num_threads: Of this kernel; no result depends on it.
            options: See `BatchedCollector`, also for errors.
        """
        super().__init__(env, actor, **options)
        self._actor_keys = None if keep_actor_entries else ("action", *actor_keys)
        if compiled:
            self.fused = FusedEpisodes.try_create(
                self.base_env, actor, keep_actor_entries, num_threads
            )

    @torch.no_grad()
    def collect(self, num_envs: int | None = None) -> TensorDictBase:
        """Run an episode in every environment, or in the first `num_envs`. Shape: (T_total,)."""
        size = self.env.batch_size[0]
        count = size if num_envs is None else min(num_envs, size)
        env = self.base_env
        started = env.start()[torch.arange(count, device=env.device)]
        entries = None if isinstance(self.fused, Reasons) else self.fused.run(started)
        if entries is None:
            entries = self._step(self._agent, started)
        elif self._info:  # the task's batched step computes it; nothing is rendered
            entries |= self._step(_Again(entries["action"], entries[EPISODE]), started)
        entries |= env.outcome(entries[END_REASON], entries[REWARD])
        entries[EPISODE] = entries[EPISODE] + self.episodes
        batch = TensorDict({}, [len(entries[EPISODE])], device=env.device)
        for key, value in entries.items():
            batch.set(key, value)
        return self._finish(batch, count)

    def _step(self, agent: Agent, started: State) -> Entries:
        """Run episodes step by step; return the same entries as `FusedEpisodes.run`."""
        taken: list[Entries] = []
        for step in steps(agent, self.base_env.observer, started):
            acted = {**step.act.entries, "action": step.act.action}
            keys = acted if self._actor_keys is None else self._actor_keys
            kept = {key: acted[key] for key in keys} | self._kept_info(step)
            ends = {REWARD: step.reward, END_REASON: step.after.end_reason}
            taken.append({EPISODE: step.rows, **ends, **kept})
        order = torch.cat([step[EPISODE] for step in taken]).argsort(stable=True)
        return {key: torch.cat([step[key] for step in taken])[order] for key in taken[0]}

    def state_dict(self) -> dict[str, Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return counters and the environments' random streams between two batches."""
        worlds = self.base_env.state_dict()
        return {"frames": self.frames, "episodes": self.episodes, "worlds": worlds}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resume from a `state_dict`."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self.base_env.load_state_dict(state_dict["worlds"])


class _Again:
    """Takes the actions of a batch of complete episodes, (T_total,), again."""

    def __init__(self, actions: Tensor, env_of_step: Tensor) -> None:
        lengths = env_of_step.bincount()
        self._actions, self._next = actions, lengths.cumsum(0) - lengths

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        now = self._next[context.rows]
        self._next[context.rows] += 1
        return Act(self._actions[now])
