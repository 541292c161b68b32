"""Trains our environment with nothing but TorchRL's own collector, our loss and our returns.

python examples/train_with_torchrl.py     # to 2.97 of 3 cubes: about a minute on two cores
"""

import logging

import torch
from torchrl.collectors import Collector
from torchrl.envs import Compose, RewardSum, TransformedEnv

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.objectives import LeaveOneOut, ReinforceLoss
from drone_rl.policies import SmallCNN, make_actor

NUM_ENVS = 16
STEPS = 200
"""Of each world in a batch: a first, aimless episode takes about 130, a good one 45."""


def train(
    *,
    target: float = 2.97,
    max_frames: int = 1_000_000,
    num_envs: int = NUM_ENVS,
    steps: int = STEPS,
    seed: int = 0,
) -> list[float]:
    """Trains until the mean reward of a batch's episodes reaches the target.

    Args:
        target: Reward, of 3 cubes.
        max_frames: Stop after so many in any case.
        num_envs: Worlds.
        steps: Of each world in a batch.
        seed: Of worlds, weights and actions.

    Returns:
        The mean reward of each batch's episodes.
    """
    pipeline = Compose(GrayPixels(), StandardizePixels(), RewardSum())
    env = TransformedEnv(DroneEnv(num_envs, seed=seed), pipeline)
    generator = torch.Generator().manual_seed(seed)
    shape = env.observation_spec["pixels"].shape[1:]
    actor = make_actor(
        SmallCNN(shape, 3, hidden=(128,), generator=generator), env.action_spec, generator
    )
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
    optimiser = torch.optim.Adam(loss.parameters(), lr=2e-3)
    rewards: list[float] = []
    for batch in collector:
        ended = batch["next", "done"]
        rewards.append(float(batch["next", "episode_reward"][ended].mean()))
        logging.info("%d episodes, mean reward %.2f", int(ended.sum()), rewards[-1])
        if rewards[-1] >= target:
            break
        optimiser.zero_grad()
        loss(batch)["loss_actor"].backward()
        optimiser.step()
    collector.shutdown()
    return rewards


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    train()
