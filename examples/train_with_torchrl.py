"""Train with TorchRL's own collector and drone_rl's environment, returns and loss.

python examples/train_with_torchrl.py     # to 2.97 of 3 cubes: half a minute on two cores
"""

import dataclasses
import logging
import time

import torch
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import Compose, RewardSum, TransformedEnv

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.objectives import LeaveOneOut, ReinforceLoss
from drone_rl.policies import SmallCNN, make_actor


@dataclasses.dataclass
class Training:
    """Result of a training."""

    network: nn.Module
    frames: int = 0
    running_reward: float = 0.0
    """Exponential mean of the episode reward, with a decay of 0.99 per episode."""
    history: list[tuple[float, float]] = dataclasses.field(default_factory=list)
    """Seconds since the epoch and running reward, after each batch."""


def train(
    *,
    target: float = 2.97,
    max_frames: int = 960_000,
    num_envs: int = 16,
    steps: int = 200,
    lr: float = 2e-3,
    seed: int = 0,
) -> Training:
    """Train until the running mean of the episode reward reaches the target.

    Args:
        target: Cubes per episode, of 3.
        max_frames: Largest number of frames.
        num_envs: Number of environments.
        steps: Steps of each environment in a batch. Random episodes take about 130, good ones 45.
        lr: Learning rate.
        seed: Seed of environments, weights and actions.
    """
    pipeline = Compose(GrayPixels(), StandardizePixels(), RewardSum())
    env = TransformedEnv(DroneEnv(num_envs, seed=seed), pipeline)
    generator = torch.Generator().manual_seed(seed)
    shape = env.observation_spec["pixels"].shape[1:]
    done = Training(SmallCNN(shape, 3, hidden=(128,), generator=generator))
    actor = make_actor(done.network, env.action_spec, generator)
    collector = Collector(
        env,
        actor,
        frames_per_batch=num_envs * steps,
        total_frames=max_frames,
        reset_at_each_iter=True,
        postproc=LeaveOneOut(0.95, scale=True),
        auto_register_policy_transforms=False,
    )
    loss = ReinforceLoss(actor, entropy_coeff=0.0)
    optimizer = torch.optim.Adam(loss.parameters(), lr=lr)
    for batch in collector:
        done.frames += batch.numel()
        for reward in batch["next", "episode_reward"][batch["next", "done"]].tolist():
            done.running_reward += 0.01 * (reward - done.running_reward)
        done.history.append((time.time(), done.running_reward))
        logging.info("%d frames, running reward %.2f", done.frames, done.running_reward)
        if done.running_reward >= target:
            break
        optimizer.zero_grad()
        loss(batch)["loss_actor"].backward()
        optimizer.step()
    collector.shutdown()
    return done


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    train()
