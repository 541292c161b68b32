"""Runs a policy on many worlds at once and gathers how the episodes ended."""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor, equal
from torchrl.envs import EnvBase
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector, take_rows
from drone_rl.envs import worlds_of
from drone_rl.evaluation.metrics import Episodes
from drone_rl.utils.provenance import num_cores


@dataclasses.dataclass
class StepLog:
    """What was done at each step of some episodes, to compare implementations by."""

    implementation: str = ""
    """What computed the actions: "fused kernel" or "PyTorch"."""
    actions: list[Tensor] = dataclasses.field(default_factory=list)
    """Of each episode. Shapes: (T, *)."""

    def note(self, batch: TensorDictBase) -> None:
        """Add a batch of whole episodes, one after the other."""
        action, episode = (cast(Tensor, batch[k]) for k in ("action", ("collector", "traj_ids")))
        lengths = episode.unique_consecutive(return_counts=True)[1]
        self.actions += action.cpu().split(lengths.tolist())


def run_episodes(
    env: EnvBase,
    actor: TensorDictModuleBase,
    num_episodes: int,
    *,
    greedy: bool = True,
    is_compiled: bool = False,
    log: StepLog | None = None,
) -> Episodes:
    """Runs complete episodes, `env.batch_size[0]` at a time.

    World i draws its episodes from a stream of its own, one at a time, so that whatever the policy
    the k-th episode is flown in the same world.

    Args:
        env: A batch of worlds.
        actor: The policy.
        num_episodes: How many; what a last batch has more is not used.
        greedy: Whether to take the most probable action instead of drawing one.
        is_compiled: Whether a kernel may fly them, see `EpisodeCollector`.
        log: Takes the actions, of whole batches.

    Returns:
        The episodes, on the CPU.
    """
    task = worlds_of(env).task
    keep = tuple(("next", "info", name) for name in (*task.scored, "end_reason"))
    collector = EpisodeCollector(
        env,
        actor,
        keep=keep,
        keep_observations=False,
        is_compiled=is_compiled,
        num_cores=num_cores(),
    )
    kind = ExplorationType.DETERMINISTIC if greedy else ExplorationType.RANDOM
    finals, lengths, count = [], [], 0
    if log is not None:
        log.implementation = collector.implementation
    with set_exploration_type(kind):
        while count < num_episodes:
            batch = collector.collect()
            if log is not None:
                log.note(batch)
            done = cast(Tensor, batch["next", "done"])[:, 0].nonzero()[:, 0]
            finals.append(take_rows(cast(TensorDictBase, batch["next", "info"]), done))
            lengths.append(batch["collector", "traj_ids"].unique(return_counts=True)[1])
            count += len(lengths[-1])
    info = cast(Mapping[str, Tensor], torch.cat(finals)[:num_episodes])
    return Episodes.ended(task, info, torch.cat(lengths)[:num_episodes])


def env_base(env: EnvBase) -> Any:
    """The environment behind transforms."""
    return getattr(env, "base_env", env)


def streams(env: EnvBase) -> dict[str, Any]:
    """What an environment's next episodes follow from."""
    return env_base(env).state_dict()


def batches(
    env: EnvBase,
    actor: TensorDictModuleBase,
    episodes: int,
    noted: tuple[str, ...] = (),
    *,
    is_compiled: bool = False,
    log: StepLog | None = None,
) -> Iterator[TensorDictBase]:
    """Greedy episodes, no more than are asked for; by the fused kernel if it may and can."""
    keep = tuple(("next", "info", name) for name in (*worlds_of(env).task.scored, "end_reason"))
    collector = EpisodeCollector(
        env,
        actor,
        keep=keep,
        keep_observations=False,
        noted=noted,
        is_compiled=is_compiled,
        num_cores=num_cores(),
    )
    if log is not None:
        log.implementation = collector.implementation
    left = episodes
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        while left > 0:
            count = min(left, env.batch_size[0])
            yield collector.collect(count)
            left -= count


def final(env: EnvBase, batch: TensorDictBase) -> Episodes:
    """How the episodes of a batch ended."""
    task = worlds_of(env).task
    done = cast(Tensor, batch["next", "done"])[:, 0].nonzero()[:, 0]
    info = {
        name: cast(Tensor, batch["next", "info", name])[done]
        for name in (*task.scored, "end_reason")
    }
    lengths = cast(Tensor, batch["collector", "traj_ids"]).unique_consecutive(return_counts=True)
    return Episodes.ended(task, info, lengths[1])


def parting(one: Tensor, other: Tensor) -> int | None:
    """The first step at which actions differ; None if none do."""
    shared = min(len(one), len(other))
    steps = (one[:shared] != other[:shared]).nonzero()
    if len(steps):
        return int(steps[0, 0])
    return None if len(one) == len(other) else shared


def ending(one: Episodes, other: Episodes, i: int) -> int | None:
    """The last step if episodes end otherwise; None if they end alike."""
    is_same = bool(one.end_reason[i] == other.end_reason[i]) and equal(
        one.goals.reached[i], other.goals.reached[i]
    )
    return None if is_same else int(one.length[i])


def only(flags: Tensor) -> int | None:
    """The place of the only true flag; None if there is another number of them."""
    places = flags.nonzero()[:, 0]
    return int(places[0]) if len(places) == 1 else None


_TOLD = ("collected", "cube_positions")


def find_failures(
    env: EnvBase, actor: TensorDictModuleBase, num_episodes: int, enough: int
) -> tuple[NDArray[np.float64], int]:
    """Flies complete episodes greedily, and notes those in which a cube is left behind.

    Args:
        env: A batch of worlds.
        actor: The policy.
        num_episodes: How many, at least: whole batches are flown.
        enough: After so many failures no further batch is flown.

    Returns:
        Where the cubes stood when it failed, metres to the left of the start, of shape (failures,
        num_cubes), and how many episodes were flown.
    """
    keep = tuple(("next", "info", name) for name in _TOLD)
    collector = EpisodeCollector(env, actor, keep=keep, keep_observations=False)
    found: list[NDArray[np.float64]] = []
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        while collector.episodes < num_episodes and sum(map(len, found)) < enough:
            batch = collector.collect()
            is_last = batch["next", "done"][:, 0]
            collected, cubes = (batch["next", "info", name][is_last] for name in _TOLD)
            failed = cubes[~collected.all(-1)]
            found.append(np.asarray(failed[..., 1].double().cpu()))
    return np.concatenate(found), collector.episodes
