"""Our network up to its logits, for Stable-Baselines3 to put its own heads upon."""

from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor

from drone_rl.config.networks import Network, SmallCnn
from drone_rl.policies.cnn import PolicyNetwork
from drone_rl.utils.errors import InputError


class Sb3Trunk(BaseFeaturesExtractor):
    """A features extractor: `policy_kwargs={"features_extractor_class": Sb3Trunk, "net_arch": []}`.

    Raises:
        InputError: The observations are no pictures with the channels first.
    """

    def __init__(self, observation_space: spaces.Box, network: Network | None = None) -> None:
        """Builds it with fresh weights, which Stable-Baselines3 then makes orthogonal as ours.

        Args:
            observation_space: Pictures (C, H, W).
            network: Which; the default's by default.
        """
        shape = observation_space.shape
        if len(shape) != 3:
            raise InputError(f"Sb3Trunk got observations of shape {shape}; give pictures (C, H, W)")
        made: Any = (network or SmallCnn()).make(shape, 1)
        assert isinstance(made, PolicyNetwork)
        width = made.layers.get_parameter("logits.weight").shape[1]
        super().__init__(observation_space, features_dim=width)
        # with our order of the weights in memory its initialisation could not do
        self.layers = made.layers[:-1].to(memory_format=torch.contiguous_format)  # pyright: ignore[reportCallIssue] (torch's annotations lack it)

    def forward(self, observations: Tensor) -> Tensor:
        """Pictures (N, C, H, W) to features (N, features_dim)."""
        return self.layers(observations)
