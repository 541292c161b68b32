"""Greedy episodes from the same start by several implementations, and where they part."""

from collections.abc import Iterator
from typing import Any, cast

from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor, equal
from torchrl.envs import EnvBase
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector
from drone_rl.envs import worlds_of
from drone_rl.evaluation.evaluator import StepLog
from drone_rl.evaluation.metrics import Episodes
from drone_rl.utils.provenance import num_cores


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
        acceleration="fused" if is_compiled else "direct",
        num_threads=num_cores(),
    )
    if log is not None:
        log.implementation = collector.source.implementation
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
