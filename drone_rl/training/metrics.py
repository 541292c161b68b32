"""What a training says of itself: pure functions of batches."""

import enum
from collections.abc import Iterable
from typing import cast

import torch
from tensordict import TensorDictBase
from torch import Tensor

from drone_rl.utils.errors import InputError


def episode_rewards(batch: TensorDictBase) -> Tensor:
    """Reward of each episode that ends in a batch, in the batch's order. Shape: (num_episodes,).

    Args:
        batch: Rows of complete episodes; or pieces of fixed length with ("next",
            "episode_reward"), which `RolloutCollector` and TorchRL's transform `RewardSum` write,
            since the first part of an episode may lie in an earlier batch. Shape: (*batch, T).

    Raises:
        InputError: An episode is not complete and its reward so far not known.
    """
    done, reward = (cast(Tensor, batch["next", name]) for name in ("done", "reward"))
    totals = batch.get(("next", "episode_reward"), None)
    if totals is not None:
        return totals[done].double()
    if not bool(done[..., -1, :].all()):
        raise InputError(
            "a batch ends within an episode, whose reward is not known; collect complete episodes, "
            "or by collector=rollouts, or put TorchRL's RewardSum behind the environment"
        )
    ends = done.flatten().nonzero()[:, 0]
    cumulative = reward.flatten().double().cumsum(0)[ends]
    return torch.diff(cumulative, prepend=cumulative.new_zeros(1))


def running_mean(old: float, values: Tensor, decay: float) -> float:
    """Takes values in one by one: m <- decay * m + (1 - decay) * value."""
    for value in values.tolist():
        old = decay * old + (1 - decay) * value
    return old


def batch_metrics(batch: TensorDictBase, ends: Iterable[enum.IntEnum] = ()) -> dict[str, float]:
    """Means over the episodes that end in a batch, and the shares of the reasons why.

    Args:
        batch: See `episode_rewards`.
        ends: What ("next", "info", "end_reason") may be (`Task.ends`); 0 is none.

    Returns:
        By name; NaN where no episode ends.
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
    return metrics
