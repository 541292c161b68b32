"""Trains our environment with nothing but TorchRL's own collector, our loss and our returns.

python examples/train_with_torchrl.py     # to 2.97 of 3 cubes: half a minute on two cores
"""

import dataclasses
import logging

import torch
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import Compose, RewardSum, TransformedEnv

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.objectives import LeaveOneOut, ReinforceLoss
from drone_rl.policies import SmallCNN, make_actor


@dataclasses.dataclass
class Training:
    """What came of it."""

    network: nn.Module
    frames: int = 0
    running_reward: float = 0.0
    """Of the episodes, of which each leaves 99%."""


def train(
    *,
    target: float = 2.97,
    max_frames: int = 960_000,
    num_envs: int = 16,
    steps: int = 200,
    lr: float = 2e-3,
    seed: int = 0,
) -> Training:
    """Trains until the running mean of the episodes' rewards reaches the target.

    Args:
        target: Of 3 cubes.
        max_frames: Stop after so many in any case.
        num_envs: Worlds.
        steps: Of each world in a batch: a first, aimless episode takes about 130, a good one 45.
        lr: Learning rate.
        seed: Of worlds, weights and actions.
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
    loss = ReinforceLoss(actor)
    optimiser = torch.optim.Adam(loss.parameters(), lr=lr)
    for batch in collector:
        done.frames += batch.numel()
        for reward in batch["next", "episode_reward"][batch["next", "done"]].tolist():
            done.running_reward += 0.01 * (reward - done.running_reward)
        logging.info("%d frames, running reward %.2f", done.frames, done.running_reward)
        if done.running_reward >= target:
            break
        optimiser.zero_grad()
        loss(batch)["loss_actor"].backward()
        optimiser.step()
    collector.shutdown()
    return done


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    train()
