"""Networks of this project in Stable-Baselines3, and its policies as networks of this project."""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from drone_rl.config.networks import Network, SmallCnn
from drone_rl.policies.networks import PolicyNetwork
from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.schema import shown

extra("stable_baselines3", "sb3", "drone_rl.policies.sb3")

from gymnasium import spaces  # noqa: E402 (after the check that the extra is installed)
from stable_baselines3.common.base_class import BaseAlgorithm  # noqa: E402
from stable_baselines3.common.policies import ActorCriticPolicy  # noqa: E402
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor  # noqa: E402

_SAME = 1e-4
"""Log-probabilities that differ by less count as equal."""


class Sb3Logits(nn.Module):
    """The logits of a PPO or A2C policy: `drone_rl.judge(Sb3Logits(model))`.

    A policy that was trained on bytes gets frames from 0 to 1, as from the transform `Rgb`.

    Raises:
        InputError: It is no model, or no actor-critic with discrete actions, is recurrent, or needs
            more than one array.
    """

    def __init__(self, model: BaseAlgorithm) -> None:
        """Take the modules between frame and logits, which it shares with the model."""
        super().__init__()
        if not isinstance(model, BaseAlgorithm):
            raise InputError(
                f"model={shown(model)} is no model of Stable-Baselines3; give one, such as "
                "stable_baselines3.PPO.load(path)"
            )
        policy, space = model.policy, model.policy.observation_space
        if not isinstance(policy, ActorCriticPolicy) or not hasattr(policy.action_space, "n"):
            raise _refusal(model)
        if not isinstance(space, spaces.Box):
            raise _refusal(model)
        self.observes_bytes = space.dtype == np.uint8
        self.observation_shape = _channels_first(space.shape)
        self.scale = 255.0 if self.observes_bytes and not policy.normalize_images else 1.0
        self.trunk = policy.pi_features_extractor
        self.hidden = policy.mlp_extractor.policy_net
        self.logits = policy.action_net
        if not self._agrees(policy):
            raise _refusal(model)

    observes_bytes: bool
    """Whether the model was trained on frames of bytes; three channels are RGB."""
    observation_shape: tuple[int, ...] | None
    """Of one frame, channels first; None if the model was not trained on frames."""

    def forward(self, pixels: Tensor) -> Tensor:
        """Frames (N, C, H, W) to logits (N, number of actions)."""
        return self.logits(self.hidden(self.trunk(pixels * self.scale)))

    @torch.no_grad()
    def _agrees(self, policy: ActorCriticPolicy) -> bool:
        """Return whether it gives the policy's logits of a random image; recurrent ones differ."""
        shape = policy.observation_space.shape or ()
        image = torch.rand(1, *shape, generator=torch.Generator().manual_seed(0)).to(policy.device)
        try:
            given = image * 255.0 if self.observes_bytes else image
            distribution: Any = policy.get_distribution(given).distribution
        except TypeError:
            return False
        own = self(image).log_softmax(-1)
        return bool(torch.allclose(own, distribution.logits, atol=_SAME))


def _channels_first(shape: tuple[int, ...]) -> tuple[int, ...] | None:
    if len(shape) != 3:
        return None
    return shape if shape[0] <= shape[-1] else (shape[-1], *shape[:-1])


def _refusal(model: BaseAlgorithm) -> InputError:
    return InputError(
        f"the policy of {type(model).__name__} gives no logits of a single image; give one of PPO "
        "or A2C with discrete actions, or a callable from images to logits"
    )


class Sb3Trunk(BaseFeaturesExtractor):
    """A features extractor: `policy_kwargs={"features_extractor_class": Sb3Trunk, "net_arch": []}`.

    Raises:
        InputError: The observations do not have three dimensions, or the network is recurrent or
            has a forward of its own.
    """

    def __init__(self, observation_space: spaces.Box, network: Network | None = None) -> None:
        """Build it for frames (C, H, W); Stable-Baselines3 initialises it orthogonally."""
        shape = observation_space.shape
        if len(shape) != 3:
            raise InputError(f"Sb3Trunk got observations of shape {shape}; give images (C, H, W)")
        made: Any = (network or SmallCnn()).make(shape, 1)
        if not isinstance(made, PolicyNetwork) or not made.is_sequential:
            raise InputError(
                f"Sb3Trunk got {type(made).__name__}, which is recurrent or has its own forward; "
                "give the settings of a network without them, such as SmallCnn()"
            )
        width = made.layers.get_parameter("logits.weight").shape[1]
        super().__init__(observation_space, features_dim=width)
        # Stable-Baselines3's initialization needs contiguous weights, not channels_last
        self.layers = made.layers[:-1].to(memory_format=torch.contiguous_format)  # pyright: ignore[reportCallIssue] (torch's annotations lack it)

    def forward(self, observations: Tensor) -> Tensor:
        """Frames (N, C, H, W) to features (N, features_dim)."""
        return self.layers(observations)
