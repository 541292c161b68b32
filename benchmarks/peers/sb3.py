"""Train Stable-Baselines3's algorithms with the default network until the task is solved."""

import time
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from benchmarks.peers.outcome import DECAY, TARGET, Curve, PeerTraining
from drone_rl.config.transforms import Gray, Standardize, Transform
from drone_rl.envs.gymnasium.environments import DroneWorlds
from drone_rl.envs.sb3.worlds import Sb3Worlds
from drone_rl.policies.external_policy import policy_from
from drone_rl.policies.sb3 import Sb3Trunk
from drone_rl.training.metrics import running_mean
from drone_rl.utils.errors import InputError

ALGORITHMS: Mapping[str, type[OnPolicyAlgorithm]] = MappingProxyType({"ppo": PPO, "a2c": A2C})
"""Algorithms by name."""
NUM_ENVS = 64
TRANSFORMS: tuple[Transform, ...] = (Gray(), Standardize())
"""Transforms of the default network's observations."""


class Solved(BaseCallback):
    """Stop a training when the running mean of episode rewards reaches a target."""

    def __init__(self, target: float, decay: float = DECAY) -> None:
        """Start the running mean at 0.

        Args:
            target: Target of the running mean.
            decay: Decay of the running mean for each episode.
        """
        super().__init__()
        self.target, self.decay = target, decay
        self.running_reward, self.episodes = 0.0, 0
        self.history: Curve = []
        self._earned = np.zeros(1)

    @property
    def is_reached(self) -> bool:
        """Whether the target has been reached."""
        return self.running_reward >= self.target

    def count(self, rewards: np.ndarray, done: np.ndarray) -> None:
        """Add a step. Shapes: (num_envs,)."""
        self._earned = self._earned + rewards
        ended = torch.from_numpy(self._earned[done])
        self.running_reward = running_mean(self.running_reward, ended, self.decay)
        self.episodes += len(ended)
        self._earned = np.where(done, 0.0, self._earned)

    def _on_rollout_end(self) -> None:
        self.history.append((time.time(), self.running_reward))

    def _on_step(self) -> bool:
        self.count(self.locals["rewards"], self.locals["dones"])
        return not self.is_reached


def train_sb3(
    algorithm: str,
    seed: int,
    *,
    environment: str = "drone_rl/CollectCubes-v0",
    num_envs: int = NUM_ENVS,
    target: float = TARGET,
    max_frames: int = 1_000_000,
    **settings: Any,
) -> PeerTraining:
    """Train until the running mean of episode rewards reaches a target.

    Args:
        algorithm: "ppo" or "a2c".
        seed: Seed of environments, weights and actions.
        environment: Gymnasium ID of the environment.
        num_envs: Number of environments.
        target: Target of the running mean.
        max_frames: Stop after this number of frames in any case.
        settings: Settings of the algorithm.

    Raises:
        InputError: The algorithm is unknown.
    """
    if algorithm not in ALGORITHMS:
        raise InputError(f"algorithm={algorithm!r} is unknown; give {', '.join(ALGORITHMS)}")
    worlds = gymnasium.make_vec(
        environment, num_envs=num_envs, autoreset_mode="SameStep", transforms=TRANSFORMS
    )
    assert isinstance(worlds, DroneWorlds)
    env, solved = Sb3Worlds(worlds), Solved(target)
    model = ALGORITHMS[algorithm](
        "MlpPolicy",  # only its trunk and heads are used
        env,
        seed=seed,
        policy_kwargs={"features_extractor_class": Sb3Trunk, "net_arch": []},
        device="cpu",
        **settings,
    )
    model.learn(max_frames, callback=solved)
    solved.history.append((time.time(), solved.running_reward))
    env.close()
    policy = policy_from(model, name=f"sb3 {algorithm}")
    return PeerTraining(solved.is_reached, model.num_timesteps, solved.history, policy)
