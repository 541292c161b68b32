"""Networks of this project in Stable-Baselines3, and its policies as networks of this project."""

import copy
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from drone_rl.config.networks import Network, SmallCnn
from drone_rl.config.transforms import Transform
from drone_rl.policies.external_network import copied
from drone_rl.policies.networks import PolicyNetwork
from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.schema import shown

extra("stable_baselines3", "sb3", "drone_rl.policies.sb3")

import gymnasium  # noqa: E402 (after the check that the extra is installed)
from gymnasium import spaces  # noqa: E402
from gymnasium.vector.utils import create_empty_array  # noqa: E402
from stable_baselines3.common.base_class import BaseAlgorithm  # noqa: E402
from stable_baselines3.common.policies import ActorCriticPolicy  # noqa: E402
from stable_baselines3.common.preprocessing import (  # noqa: E402
    is_image_space,
    is_image_space_channels_first,
)
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor  # noqa: E402
from stable_baselines3.common.utils import check_for_correct_spaces  # noqa: E402
from stable_baselines3.common.vec_env import (  # noqa: E402
    DummyVecEnv,
    VecEnv,
    VecTransposeImage,
    is_vecenv_wrapped,
)

from drone_rl.policies.sb3_observations import Observations, to_space  # noqa: E402


class Sb3Logits(nn.Module):
    """The log-probabilities of a PPO or A2C policy, a copy in evaluation mode; see `policy_from`.

    Raises:
        InputError: It is no model, or no actor-critic with discrete actions, or needs a state or
            an environment that was not given, or is not that of the model.
    """

    def __init__(self, model: BaseAlgorithm, env: VecEnv | gymnasium.Env | None = None) -> None:
        """Copy the policy; read the wrappers of its environment, by default those of the model."""
        super().__init__()
        if not isinstance(model, BaseAlgorithm):
            raise InputError(
                f"model={shown(model)} is no model of Stable-Baselines3; give one, such as "
                "stable_baselines3.PPO.load(path)"
            )
        kind, space = type(model).__name__, model.policy.observation_space
        is_discrete = isinstance(model.policy.action_space, spaces.Discrete)
        is_actor = isinstance(model.policy, ActorCriticPolicy) and is_discrete
        if not is_actor or not isinstance(space, spaces.Box | spaces.Dict):
            raise InputError(
                f"the policy of {kind} gives no logits of images; give one of PPO or A2C with "
                "discrete actions, or a callable from images to logits"
            )
        self.policy: Any = _copy_of(model.policy)
        sample: Any = create_empty_array(space)
        _, state = self.policy.predict(sample, deterministic=True)
        if state is not None:
            raise InputError(
                f"the policy of {kind} is recurrent: it needs its state of the frames before; give "
                "a policy of single images, or of a stack of them (VecFrameStack)"
            )
        vec_env = model.get_env() if env is None else _as_vec_env(env)
        self.observations = Observations(vec_env, space)
        if model.get_vec_normalize_env() and "VecNormalize" not in self.observations.names:
            raise InputError(
                f"{kind} was trained with VecNormalize, which its environment lacks; give "
                "drone_rl.policy_from env=, the environment of the training with its wrappers"
            )
        if vec_env is not None:
            _check_spaces(vec_env, model.policy)
        self.conditions = {"name": f"{kind} of Stable-Baselines3", **self.observations.conditions}

    conditions: dict[str, Any]
    """Name, camera, task, dynamics and actions, as far as they are known."""

    def forward(self, pixels: Tensor | dict[str, Tensor]) -> Tensor:
        """Frames (N, C, H, W), bytes as 0 to 1, to log-probabilities (N, number of actions).

        A model of several inputs takes a dictionary of them.
        """
        if isinstance(pixels, dict):
            return self._log_probabilities(pixels)
        seen = to_space(pixels, self.observations.space)
        return self._log_probabilities(seen)

    def predict(
        self, frames: Any, transforms: Sequence[Transform] | None = None
    ) -> tuple[Tensor, Tensor]:
        """Return what the library itself does in an episode, with its wrappers.

        Args:
            frames: RGB, uint8, of shape (T, H, W, 3), or several inputs, a TensorDict (T,).
            transforms: Those up to the wrappers, where the environment's are unknown.

        Returns:
            The deterministic actions, (T,), and the log-probabilities, (T, number of actions).
        """
        if isinstance(frames, Tensor):
            seen: Any = self.observations.of_episode(frames, transforms)
        else:
            seen = {name: values.numpy() for name, values in frames.items()}
        actions, _ = self.policy.predict(seen, deterministic=True)
        tensor, _ = self.policy.obs_to_tensor(seen)
        return torch.from_numpy(actions), self._log_probabilities(tensor)

    def _log_probabilities(self, seen: Any) -> Tensor:
        made = self.policy.get_distribution(seen)
        logits = made.distribution.logits
        made.distribution = None  # the policy holds it, and torch copies no results
        return logits


def _copy_of(policy: Any) -> nn.Module:
    """Return a copy without the optimizer and without the last distribution."""
    actions: Any = copy.copy(policy.action_dist)
    actions.distribution = None
    return copied(policy, {id(policy.action_dist): actions, id(policy.optimizer): None})


def _as_vec_env(env: VecEnv | gymnasium.Env) -> VecEnv:
    """Return a vector environment, with the channels first where the library moves them."""
    if not isinstance(env, VecEnv | gymnasium.Env):
        raise InputError(
            f"env={shown(env)} is no environment of Stable-Baselines3; give the one of the training"
        )
    batch = env if isinstance(env, VecEnv) else DummyVecEnv([lambda: env])
    space: Any = batch.observation_space
    is_last = is_image_space(space) and not is_image_space_channels_first(space)
    is_moved = is_vecenv_wrapped(batch, VecTransposeImage)
    return VecTransposeImage(batch) if is_last and not is_moved else batch


def _check_spaces(env: VecEnv, policy: Any) -> None:
    try:
        check_for_correct_spaces(env, policy.observation_space, policy.action_space)
    except ValueError as error:
        raise InputError(
            f"env= is not the environment of the model: {' '.join(str(error).split())}; give "
            "drone_rl.policy_from env=, the environment of the training with its wrappers"
        ) from None


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
