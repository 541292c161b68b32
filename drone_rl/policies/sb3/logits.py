"""A policy that Stable-Baselines3 trained, as a network from pictures to logits."""

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn
from torch.distributions import Categorical

from drone_rl.utils.errors import InputError


class Sb3Logits(nn.Module):
    """What the policy of PPO or A2C makes of pictures: `drone_rl.judge(Sb3Logits(model))`.

    A policy that was trained on bytes gets pictures from 0 to 1 here, such as the transform `Rgb`
    makes.

    Raises:
        InputError: The model has no probabilities of a few actions.
    """

    def __init__(self, model: BaseAlgorithm) -> None:
        """Takes the model's policy, which it shares.

        Args:
            model: Of an actor-critic algorithm with discrete actions.
        """
        super().__init__()
        policy = model.policy
        if not isinstance(policy, ActorCriticPolicy) or not hasattr(policy.action_space, "n"):
            raise InputError(
                f"the policy of {type(model).__name__} has no logits; give one of PPO or A2C with "
                "discrete actions, or a callable from pictures to logits"
            )
        self.policy = policy
        self.scale = 255.0 if policy.observation_space.dtype == np.uint8 else 1.0

    def forward(self, pixels: Tensor) -> Tensor:
        """Pictures (N, C, H, W) to logits (N, number of actions)."""
        distribution = self.policy.get_distribution(pixels * self.scale).distribution
        assert isinstance(distribution, Categorical)
        return distribution.logits
