"""A policy that Stable-Baselines3 trained, as a network from pictures to logits."""

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from drone_rl.utils.errors import InputError

_SAME = 1e-4
"""Log-probabilities that differ by less are the model's own."""


class Sb3Logits(nn.Module):
    """What the policy of PPO or A2C makes of pictures: `drone_rl.judge(Sb3Logits(model))`.

    A policy that was trained on bytes gets pictures from 0 to 1 here, such as the transform `Rgb`
    makes.

    Raises:
        InputError: The model has no probabilities of a few actions that depend on a picture alone.
    """

    def __init__(self, model: BaseAlgorithm) -> None:
        """Takes the modules between picture and logits, which it shares with the model.

        Args:
            model: Of an actor-critic algorithm with discrete actions.
        """
        super().__init__()
        policy = model.policy
        if not isinstance(policy, ActorCriticPolicy) or not hasattr(policy.action_space, "n"):
            raise _refusal(model)
        self.observes_bytes = policy.observation_space.dtype == np.uint8
        self.observation_shape = _channels_first(policy.observation_space.shape or ())
        self.scale = 255.0 if self.observes_bytes and not policy.normalize_images else 1.0
        self.trunk = policy.pi_features_extractor
        self.hidden = policy.mlp_extractor.policy_net
        self.logits = policy.action_net
        if not self._agrees(policy):
            raise _refusal(model)

    observes_bytes: bool
    """Whether the model was trained on frames of bytes, which are RGB if there are three."""
    observation_shape: tuple[int, ...] | None
    """Of one frame, channels first; None if the model was not trained on frames."""

    def forward(self, pixels: Tensor) -> Tensor:
        """Pictures (N, C, H, W) to logits (N, number of actions)."""
        return self.logits(self.hidden(self.trunk(pixels * self.scale)))

    @torch.no_grad()
    def _agrees(self, policy: ActorCriticPolicy) -> bool:
        """Whether it does what the policy does; one with a memory, say, does not."""
        picture = torch.zeros(1, *(policy.observation_space.shape or ()), device=policy.device)
        try:
            distribution: Any = policy.get_distribution(picture).distribution
        except TypeError:
            return False
        own = self(picture).log_softmax(-1)
        return bool(torch.allclose(own, distribution.logits, atol=_SAME))


def _channels_first(shape: tuple[int, ...]) -> tuple[int, ...] | None:
    """The shape (C, H, W) of a space of frames, whose few channels come first or last."""
    if len(shape) != 3:
        return None
    return shape if shape[0] <= shape[-1] else (shape[-1], *shape[:-1])


def _refusal(model: BaseAlgorithm) -> InputError:
    return InputError(
        f"the policy of {type(model).__name__} gives no logits of a picture alone; give one of PPO "
        "or A2C with discrete actions, or a callable from pictures to logits"
    )
