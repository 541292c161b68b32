"""What a training says of itself: pure functions of batches of complete episodes."""

import torch
from tensordict import TensorDictBase
from torch import Tensor

END_REASONS = ("all_cubes", "front_boundary", "side_boundary", "step_limit")


def episode_rewards(batch: TensorDictBase) -> Tensor:
    """Reward of each episode, in the batch's order. Shape: (num_episodes,)."""
    ends = batch["next", "done"].flatten().nonzero()[:, 0]
    cumulative = batch["next", "reward"].flatten().double().cumsum(0)[ends]
    return torch.diff(cumulative, prepend=cumulative.new_zeros(1))


def running_mean(old: float, values: Tensor, decay: float) -> float:
    """Takes values in one by one: m <- decay * m + (1 - decay) * value."""
    for value in values.tolist():
        old = decay * old + (1 - decay) * value
    return old


def batch_metrics(batch: TensorDictBase) -> dict[str, float]:
    """Means over the episodes of a batch, and the shares of the reasons why they ended."""
    rewards = episode_rewards(batch)
    done = batch["next", "done"].flatten()
    metrics = {
        "train/cubes": float(rewards.mean()),
        "train/length": len(batch) / len(rewards),
    }
    reasons = batch.get(("next", "info", "end_reason"), None)
    if reasons is not None:
        final = reasons.flatten()[done]
        for i, name in enumerate(END_REASONS, start=1):
            metrics[f"end/{name}"] = float((final == i).float().mean())
    return metrics
