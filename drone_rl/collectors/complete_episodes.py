"""Run complete episodes with a policy."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.acceleration import Reasons
from drone_rl.acceleration.fused_episodes import END_REASON
from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.envs import worlds_of
from drone_rl.envs.rollout import Agent
from drone_rl.policies.actor import exploring
from drone_rl.sim.tasks import Goals, Task
from drone_rl.utils.available_memory import EPISODE_BYTES, require_memory
from drone_rl.utils.provenance import num_cores

T = TypeVar("T")


@dataclasses.dataclass
class CompleteEpisodes:
    """`n` finished episodes of a task."""

    task: Task[Any]
    goals: Goals
    """The episodes' goals, and which were reached."""
    end_reason: Tensor  # (n,) int64
    """One of the task's ends."""
    length: Tensor  # (n,) int64
    steps: TensorDictBase | None = None
    """Kept entries of all steps, one episode after the other. Shape: (sum of the lengths,)."""
    implementation: str = ""
    """What computed the actions: "fused kernel" or "PyTorch"."""

    @classmethod
    def ended(
        cls, task: Task[Any], info: Mapping[str, Tensor], length: Tensor
    ) -> "CompleteEpisodes":
        """Build episodes from the last step's info, on the CPU.

        `info` has the task's `scored` and "end_reason", as in `Worlds.info`, shapes (n, *), and
        `length` the steps of each episode, shape (n,).
        """
        goals = task.score({name: info[name].cpu() for name in task.scored})
        return cls(task, goals, info["end_reason"][:, 0].cpu(), length.cpu())

    def __len__(self) -> int:
        """Return the number of episodes."""
        return len(self.length)

    @classmethod
    def of(cls, task: Task[Any], batch: TensorDictBase) -> "CompleteEpisodes":
        """Build episodes from a batch of `EpisodeCollector` with the task's `scored` info."""
        done = cast(Tensor, batch["next", "done"])[:, 0].nonzero()[:, 0]
        info: Any = batch["next", "info"]
        episode = cast(Tensor, batch["collector", "traj_ids"])
        lengths = episode.unique_consecutive(return_counts=True)[1]
        names = (*task.scored, "end_reason")
        return cls.ended(task, {name: info[name][done] for name in names}, lengths)

    def first(self, count: int) -> "CompleteEpisodes":
        """Return the first episodes."""
        kept, steps = slice(count), self.steps
        return dataclasses.replace(
            self,
            goals=self.goals[kept],
            end_reason=self.end_reason[kept],
            length=self.length[kept],
            steps=None if steps is None else steps[: int(self.length[kept].sum())],
        )

    def each(self, name: str) -> list[Tensor]:
        """Return a kept entry of the steps of each episode. Shapes: (T, *)."""
        assert self.steps is not None
        return [*cast(Tensor, self.steps[name]).split(self.length.tolist())]

    @classmethod
    def joined(cls, parts: Sequence["CompleteEpisodes"]) -> "CompleteEpisodes":
        """Concatenate episodes of one task."""
        goals = type(parts[0].goals).joined([part.goals for part in parts])
        ends, lengths = ([getattr(p, name) for p in parts] for name in ("end_reason", "length"))
        steps: list[Any] = [part.steps for part in parts if part.steps is not None]
        joined = cast(Any, torch.cat)(steps) if steps else None
        return cls(parts[0].task, goals, torch.cat(ends), torch.cat(lengths), joined)

    @property
    def success(self) -> Tensor:
        """1 where the episode ended with success, else 0. Shape: (n,), float64."""
        return (self.end_reason == self.task.success_end).double()

    @property
    def share(self) -> Tensor:
        """Fraction of goals reached; goals that never came up count as missed. Shape: (n,)."""
        return self.goals.reached.double().mean(-1)

    def offered(self, stratum: int) -> Tensor:
        """Return which episodes offered a goal of this stratum. Shape: (n,), bool."""
        return (self.goals.stratum == stratum).any(-1)

    def stratum_share(self, stratum: int) -> Tensor:
        """Return the fraction of a stratum's goals that was reached, NaN without any.

        Shape: (n,), float64.
        """
        there = self.goals.stratum == stratum
        return (there & self.goals.reached).sum(-1).double() / there.sum(-1)


def rollout(
    agent: TensorDictModuleBase | Agent,
    env: EnvBase,
    num_episodes: int,
    *,
    frames: int = 0,
    greedy: bool = True,
    compiled: bool = False,
    exact: bool = False,
    keep: Sequence[str] | None = ("action",),
) -> CompleteEpisodes:
    """Run complete episodes, `env.batch_size[0]` at a time; return them, on the CPU.

    Environment i samples its episodes from its own random stream, so that the k-th episode has the
    same initial state for every policy.

    Args:
        agent: The policy: an actor of TorchRL, or an agent.
        env: A batch of environments.
        num_episodes: How many.
        frames: Go on until there are so many steps, too.
        greedy: Whether an actor takes the most probable action instead of sampling one.
        compiled: Whether to use the fused kernel if it supports the policy.
        exact: Whether the last batch runs no surplus episodes, which are dropped otherwise.
        keep: Entries of steps to keep, of those that the agent reads and writes; None for all,
            with those after each step.
    """
    task = worlds_of(env).task

    def read(batch: TensorDictBase) -> CompleteEpisodes:
        part = CompleteEpisodes.of(task, batch)
        part.steps = (batch if keep is None else batch.select(*keep)).cpu()
        return part

    collector = EpisodeCollector(
        env,
        agent,
        info=task.scored,
        keep_actor_entries=keep is None,
        actor_keys=keep or (),
        compiled=compiled,
        num_threads=num_cores(),
    )
    parts = _read_batches(collector, read, num_episodes, frames, greedy, exact)
    episodes = CompleteEpisodes.joined(parts)
    episodes.implementation = "PyTorch" if isinstance(collector.fused, Reasons) else "fused kernel"
    return episodes if frames else episodes.first(num_episodes)


def end_reasons(actor: TensorDictModuleBase, env: EnvBase, num_episodes: int) -> Tensor:
    """Return why greedy episodes end, those of `rollout`. Shape: (num_episodes,).

    `rollout` would step the fused kernel's actions a second time, for the goals reached.
    """

    def read(batch: Any) -> Tensor:
        return batch[END_REASON][batch["next", "done"]]

    collector = EpisodeCollector(
        env, actor, keep_actor_entries=False, compiled=True, num_threads=num_cores()
    )
    return torch.cat(_read_batches(collector, read, num_episodes))[:num_episodes]


def _read_batches(
    collector: EpisodeCollector,
    read: Callable[[TensorDictBase], T],
    num_episodes: int,
    frames: int = 0,
    greedy: bool = True,
    exact: bool = False,
) -> list[T]:
    """Read each batch of so many episodes and steps; see `rollout`. Close the collector."""
    setting = f"episodes={num_episodes}"
    require_memory(num_episodes * EPISODE_BYTES, setting, "give fewer episodes")
    read_batches = []
    try:
        with exploring(greedy=greedy):
            while (missing := num_episodes - collector.episodes) > 0 or collector.frames < frames:
                batch = collector.collect(missing if exact and missing > 0 else None)
                read_batches.append(read(batch))
    finally:
        collector.shutdown(close_env=False)
    return read_batches
