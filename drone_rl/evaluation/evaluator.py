"""Runs a policy on many worlds at once and gathers how the episodes ended."""

import dataclasses
from collections.abc import Mapping
from typing import cast

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
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
        is_compiled: Whether the fused kernel may run them, see `EpisodeCollector`.
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
        acceleration="fused" if is_compiled else "direct",
        num_threads=num_cores(),
    )
    kind = ExplorationType.DETERMINISTIC if greedy else ExplorationType.RANDOM
    finals, lengths, count = [], [], 0
    if log is not None:
        log.implementation = collector.source.implementation
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
