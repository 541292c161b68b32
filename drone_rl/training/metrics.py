"""Rewards of the episodes in a batch, and the metrics that are logged of them."""

import enum
from collections.abc import Iterable, Sequence
from typing import Any, cast

import torch
from tensordict import TensorDictBase
from torch import Tensor

from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError


def episode_rewards(batch: TensorDictBase) -> Tensor:
    """Return the rewards of the episodes that end in a batch, in order. Shape: (num_episodes,).

    Each row (*batch, T) holds complete episodes, or has ("next", "episode_reward"), which
    `RolloutCollector` and TorchRL's `RewardSum` write; otherwise raise an `InputError`.
    """
    done, reward = (cast(Tensor, batch["next", name]) for name in ("done", "reward"))
    totals = batch.get(("next", "episode_reward"), None)
    if totals is not None:
        return totals[done].double()
    if not bool(done[..., -1, :].all()):
        raise InputError(
            "a batch ends within an episode, whose reward is not known; give collector=episodes or "
            "collector=rollouts, or add TorchRL's RewardSum to the environment's transforms"
        )
    ends = done.flatten().nonzero()[:, 0]
    cumulative = reward.flatten().double().cumsum(0)[ends]
    return torch.diff(cumulative, prepend=cumulative.new_zeros(1))


def check_rewards(batch: TensorDictBase) -> None:
    """Raise an `InputError` unless the reward of each episode that ends in a batch is finite."""
    rewards = episode_rewards(batch)
    if not bool(rewards.isfinite().all()):
        raise InputError("the reward of an episode is NaN or infinite; scale the rewards down")


def running_mean(old: float, values: Tensor, decay: float) -> float:
    """Update a mean with each value: m <- decay * m + (1 - decay) * value."""
    for value in values.tolist():
        old = decay * old + (1 - decay) * value
    return old


def success_metric(task: Task[Any]) -> str:
    """Return the name of the success rate among `batch_metrics`."""
    return f"end/{task.ends(task.success_end).name.lower()}"


def batch_metrics(
    batch: TensorDictBase, ends: Iterable[enum.IntEnum] = (), terms: Sequence[str] = ()
) -> dict[str, float]:
    """Return means over the episodes that end in a batch; NaN where none ends.

    With `ends` (`Task.ends`), also the rate of each ("next", "info", "end_reason") but 0, running.
    With several `terms` (`Task.reward_terms`), also the mean of each, ("next", "info", "paid"), and
    its share of the sum of absolute values.
    """
    rewards = episode_rewards(batch)
    done, lengths = batch["next", "done"], batch.get(("next", "step_count"), None)
    metrics = {"train/reward": float(rewards.mean())}
    if lengths is not None:
        metrics["train/length"] = float(lengths[done].double().mean())
    else:
        metrics["train/length"] = batch.numel() / len(rewards) if len(rewards) else float("nan")
    named = [end for end in ends if end]
    if named:
        reasons = cast(Tensor, batch["next", "info", "end_reason"])
        final = reasons[cast(Tensor, done)]
        for end in named:
            metrics[f"end/{end.name.lower()}"] = float((final == end).float().mean())
    if len(terms) > 1:
        paid = cast(Tensor, batch["next", "info", "paid"])[cast(Tensor, done)[..., 0]].double()
        sizes = paid.abs().sum(0)
        for name, mean, share in zip(terms, paid.mean(0), sizes / sizes.sum(), strict=True):
            metrics[f"reward/{name}"] = float(mean)
            metrics[f"reward_share/{name}"] = float(share)
    return metrics
