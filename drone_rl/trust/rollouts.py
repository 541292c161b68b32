"""Run complete episodes with a policy, and compare the episodes of two implementations."""

import dataclasses
import itertools
from collections.abc import Callable, Iterator
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors import EpisodeCollector
from drone_rl.envs import worlds_of
from drone_rl.policies.actor import exploring
from drone_rl.sim.tasks import State
from drone_rl.trust.metrics import Episodes
from drone_rl.utils.available_memory import EPISODE_BYTES, require_memory
from drone_rl.utils.provenance import num_cores

_PLACEMENT = ("collected", "cube_positions")


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
    env: EnvBase, actor: TensorDictModuleBase, num_episodes: int, **how: Any
) -> Episodes:
    """Run complete episodes, `env.batch_size[0]` at a time; return them, on the CPU.

    Environment i samples its episodes from its own random stream, so that the k-th episode has the
    same initial state for every policy. Arguments are those of `episode_batches`; by default the
    last batch is whole, and its surplus episodes, whose actions `log` receives, too, are dropped.
    """
    setting = f"episodes={num_episodes}"
    require_memory(num_episodes * EPISODE_BYTES, setting, "give fewer episodes")
    how.setdefault("is_exact", False)
    batches = episode_batches(env, actor, num_episodes, **how)
    return Episodes.joined([final_episodes(env, batch) for batch in batches])[:num_episodes]


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


def final_episodes(env: EnvBase, batch: TensorDictBase) -> Episodes:
    """Return the outcomes of a batch of complete episodes, on the CPU."""
    task = worlds_of(env).task
    done = cast(Tensor, batch["next", "done"])[:, 0].nonzero()[:, 0]
    names = (*task.scored, "end_reason")
    info = {name: cast(Tensor, batch["next", "info", name])[done] for name in names}
    return Episodes.ended(task, info, _lengths(batch))


def rollout(start: State, step: Callable[[int, State, Tensor], tuple[State, Tensor]]) -> State:
    """Step a batch of n scenes from initial states until each is over; return the final states.

    `step` is called with the number of the step, the states of the active scenes and their indices.
    It returns the next states and which of them remain active, shape (number active,), bool.
    """
    active = torch.arange(len(start), device=start.end_reason.device)
    final, state = start[active], start
    for number in itertools.count():
        state, is_active = step(number, state, active)
        final[active] = state
        if not is_active.all():
            state, active = state[is_active], active[is_active]
        if not len(active):
            break
    return final


def find_failures(
    env: EnvBase, actor: TensorDictModuleBase, num_episodes: int, enough: int
) -> tuple[NDArray[np.float64], int]:
    """Search for cube placements from which a greedy policy misses a cube.

    It runs at least `num_episodes`, in whole batches, unless `enough` failures were found before.

    Returns:
        Placements, metres to the left of the start, (failures, num_cubes); number of episodes.
    """
    found: list[NDArray[np.float64]] = []
    episodes = 0
    for batch in episode_batches(env, actor, num_episodes, keep=_PLACEMENT, is_exact=False):
        is_last = batch["next", "done"][:, 0]
        collected, cubes = (batch["next", "info", name][is_last] for name in _PLACEMENT)
        failed = cubes[~collected.all(-1)]
        found.append(np.asarray(failed[..., 1].double().cpu()))
        episodes += len(collected)
        if sum(map(len, found)) >= enough:
            break
    return np.concatenate(found), episodes


def first_difference(one: Tensor, other: Tensor) -> int | None:
    """Return the first step at which two sequences of actions differ, or None."""
    shared = min(len(one), len(other))
    steps = (one[:shared] != other[:shared]).nonzero()
    if len(steps):
        return int(steps[0, 0])
    return None if len(one) == len(other) else shared


def outcome_difference(one: Episodes, other: Episodes, i: int) -> int | None:
    """Return the length of episode i if its outcomes differ, or None."""
    is_same = bool(one.end_reason[i] == other.end_reason[i]) and torch.equal(
        one.goals.reached[i], other.goals.reached[i]
    )
    return None if is_same else int(one.length[i])


def only_index(flags: Tensor) -> int | None:
    """Return the index of the only true flag, or None if there is not exactly one."""
    places = flags.nonzero()[:, 0]
    return int(places[0]) if len(places) == 1 else None


def _lengths(batch: TensorDictBase) -> Tensor:
    """Steps of each episode of a batch. Shape: (episodes,)."""
    episode = cast(Tensor, batch["collector", "traj_ids"])
    return episode.unique_consecutive(return_counts=True)[1]
