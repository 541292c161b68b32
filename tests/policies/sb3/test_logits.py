"""Logits by hand, and their softmax against the probabilities that the model itself has."""

import numpy as np
import pytest
import torch

from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from drone_rl.policies.sb3.logits import Sb3Logits  # noqa: E402 (after the skip)


class Still(gymnasium.Env):
    """Nothing happens."""

    action_space = gymnasium.spaces.Discrete(3)

    def __init__(self, space):
        self.observation_space = space

    def reset(self, *, seed=None, options=None):
        return self.observation_space.sample(), {}


BYTES = gymnasium.spaces.Box(0, 255, (40, 48, 3), np.uint8)
FLOATS = gymnasium.spaces.Box(-1, 1, (3,), np.float32)


def test_bytes_are_pictures_from_0_to_1():
    model = sb3.A2C("CnnPolicy", Still(BYTES), seed=0)
    frames = np.stack([BYTES.sample() for _ in range(4)])
    pictures = torch.from_numpy(frames).movedim(-1, 1).float() / 255
    wish = Sb3Logits(model)(pictures).softmax(-1)
    bytes_first = torch.from_numpy(frames).movedim(-1, 1)
    wanted = model.policy.get_distribution(bytes_first).distribution.probs
    torch.testing.assert_close(wish, wanted)
    pictures.requires_grad_()
    (slope,) = torch.autograd.grad(Sb3Logits(model)(pictures)[:, 0].sum(), pictures)
    assert slope.abs().sum() > 0


def test_floats_stay_as_they_are():
    model = sb3.PPO("MlpPolicy", Still(FLOATS), seed=0, policy_kwargs={"net_arch": []})
    with torch.no_grad():
        model.policy.action_net.weight.copy_(torch.eye(3))
        model.policy.action_net.bias.zero_()
    wish = Sb3Logits(model)(torch.tensor([[0.0, 1.0, -1.0]])).softmax(-1)
    torch.testing.assert_close(wish, torch.tensor([[0.0, 1.0, -1.0]]).softmax(-1))


def test_a_model_without_probabilities_of_actions():
    model = sb3.DQN("MlpPolicy", Still(FLOATS), buffer_size=10)
    with pytest.raises(
        InputError, match=r"^the policy of DQN has no logits; give one of PPO or A2C"
    ):
        Sb3Logits(model)
