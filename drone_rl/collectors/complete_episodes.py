"""Run complete episodes with a policy."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.envs import worlds_of
from drone_rl.policies.actor import exploring
from drone_rl.sim.tasks import Goals, Task
from drone_rl.utils.available_memory import EPISODE_BYTES, require_memory
from drone_rl.utils.provenance import num_cores


@dataclasses.dataclass
class CompleteEpisodes:
    """`n` finished episodes of a task."""

    task: Task[Any]
    goals: Goals
    """The episodes' goals, and which were reached."""
    end_reason: Tensor  # (n,) int64
    """One of the task's ends."""
    length: Tensor  # (n,) int64

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

    def __getitem__(self, rows: slice | Tensor) -> "CompleteEpisodes":
        """Return some of the episodes."""
        return CompleteEpisodes(
            self.task, self.goals[rows], self.end_reason[rows], self.length[rows]
        )

    @classmethod
    def joined(cls, parts: Sequence["CompleteEpisodes"]) -> "CompleteEpisodes":
        """Concatenate episodes of one task."""
        goals = type(parts[0].goals).joined([part.goals for part in parts])
        ends, lengths = ([getattr(p, name) for p in parts] for name in ("end_reason", "length"))
        return cls(parts[0].task, goals, torch.cat(ends), torch.cat(lengths))

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
        """Return the fraction of a stratum's goals that was reached, by episode that offered one.

        Shape: (number of such episodes,), float64.
        """
        offered = self.offered(stratum)
        there = (self.goals.stratum == stratum)[offered]
        return (there & self.goals.reached[offered]).sum(-1).double() / there.sum(-1)


@dataclasses.dataclass
class StepLog:
    """The actions of some episodes, to compare implementations by."""

    implementation: str = ""
    """What computed the actions: "fused kernel" or "PyTorch"."""
    actions: list[Tensor] = dataclasses.field(default_factory=list)
    """Of each episode. Shapes: (T, *)."""

    def add(self, batch: TensorDictBase) -> None:
        """Add a batch of complete episodes, one after the other."""
        self.actions += cast(Tensor, batch["action"]).cpu().split(_lengths(batch).tolist())


def run_episodes(
    env: EnvBase,
    actor: TensorDictModuleBase,
    num_episodes: int,
    *,
    greedy: bool = True,
    is_compiled: bool = False,
    is_exact: bool = False,
    log: StepLog | None = None,
) -> CompleteEpisodes:
    """Run complete episodes, `env.batch_size[0]` at a time; return them, on the CPU.

    Environment i samples its episodes from its own random stream, so that the k-th episode has the
    same initial state for every policy. Arguments are those of `episode_batches`; by default the
    last batch is whole, and its surplus episodes, whose actions `log` receives, too, are dropped.
    """
    setting = f"episodes={num_episodes}"
    require_memory(num_episodes * EPISODE_BYTES, setting, "give fewer episodes")
    batches = episode_batches(
        env,
        actor,
        num_episodes,
        greedy=greedy,
        is_compiled=is_compiled,
        is_exact=is_exact,
        log=log,
    )
    return CompleteEpisodes.joined([final_episodes(env, batch) for batch in batches])[:num_episodes]


def episode_batches(
    env: EnvBase,
    actor: TensorDictModuleBase,
    num_episodes: int,
    actor_keys: tuple[str, ...] = (),
    *,
    keep: tuple[str, ...] | None = None,
    greedy: bool = True,
    is_compiled: bool = False,
    is_exact: bool = True,
    log: StepLog | None = None,
) -> Iterator[TensorDictBase]:
    """Yield batches of complete episodes until there are `num_episodes`.

    Args:
        env: A batch of environments.
        actor: The policy.
        num_episodes: How many.
        actor_keys: Entries that the actor reads or writes, to keep in addition to the action.
        keep: Entries of ("next", "info") to keep; by default what `final_episodes` needs.
        greedy: Whether to take the most probable action instead of sampling one.
        is_compiled: Whether to use the fused kernel if it supports the policy.
        is_exact: Whether the last batch has no surplus episodes.
        log: Receives the implementation and all actions.
    """
    if keep is None:
        keep = (*worlds_of(env).task.scored, "end_reason")
    collector = EpisodeCollector(
        env,
        actor,
        next_keys=tuple(("next", "info", name) for name in keep),
        keep_actor_entries=False,
        actor_keys=actor_keys,
        acceleration="fused" if is_compiled else "direct",
        num_threads=num_cores(),
    )
    if log is not None:
        log.implementation = collector.source.implementation
    while (missing := num_episodes - collector.episodes) > 0:
        with exploring(greedy=greedy):
            batch = collector.collect(min(missing, env.batch_size[0]) if is_exact else None)
        if log is not None:
            log.add(batch)
        yield batch


def final_episodes(env: EnvBase, batch: TensorDictBase) -> CompleteEpisodes:
    """Return the outcomes of a batch of complete episodes, on the CPU."""
    task = worlds_of(env).task
    done = cast(Tensor, batch["next", "done"])[:, 0].nonzero()[:, 0]
    names = (*task.scored, "end_reason")
    info = {name: cast(Tensor, batch["next", "info", name])[done] for name in names}
    return CompleteEpisodes.ended(task, info, _lengths(batch))


def _lengths(batch: TensorDictBase) -> Tensor:
    """Steps of each episode of a batch. Shape: (episodes,)."""
    episode = cast(Tensor, batch["collector", "traj_ids"])
    return episode.unique_consecutive(return_counts=True)[1]
