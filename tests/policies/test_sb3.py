"""Logits by hand, and their softmax against the probabilities that the model itself has."""

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.policies import ForeignNetwork
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from drone_rl.policies.sb3 import Sb3Logits  # noqa: E402 (after the skip)


class Still(gymnasium.Env):
    """Nothing happens."""

    action_space = gymnasium.spaces.Discrete(3)

    def __init__(self, space):
        self.observation_space = space

    def reset(self, *, seed=None, options=None):
        return self.observation_space.sample(), {}

    def step(self, action):
        return self.observation_space.sample(), float(action), False, False, {}


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


@pytest.mark.parametrize(
    ("space", "shape", "is_bytes"),
    [
        (BYTES, (3, 40, 48), True),
        (gymnasium.spaces.Box(0, 255, (3, 40, 48), np.uint8), (3, 40, 48), True),
        (gymnasium.spaces.Box(-1, 1, (1, 40, 48), np.float32), (1, 40, 48), False),
    ],
)
def test_what_it_was_trained_on_is_known(space, shape, is_bytes):
    kwargs = {"normalize_images": is_bytes}
    model = sb3.A2C("CnnPolicy" if is_bytes else "MlpPolicy", Still(space), policy_kwargs=kwargs)
    logits = Sb3Logits(model)
    assert (logits.observation_shape, logits.observes_bytes) == (shape, is_bytes)


def test_floats_stay_as_they_are():
    model = sb3.PPO("MlpPolicy", Still(FLOATS), seed=0, policy_kwargs={"net_arch": []})
    with torch.no_grad():
        model.policy.action_net.weight.copy_(torch.eye(3))
        model.policy.action_net.bias.zero_()
    assert Sb3Logits(model).observation_shape is None
    wish = Sb3Logits(model)(torch.tensor([[0.0, 1.0, -1.0]])).softmax(-1)
    torch.testing.assert_close(wish, torch.tensor([[0.0, 1.0, -1.0]]).softmax(-1))


def test_bytes_that_are_not_normalised():
    kwargs = {"normalize_images": False}
    model = sb3.A2C("CnnPolicy", Still(BYTES), seed=0, policy_kwargs=kwargs)
    frame = torch.from_numpy(BYTES.sample()).movedim(-1, 0)[None]
    wanted = model.policy.get_distribution(frame.float()).distribution.probs
    torch.testing.assert_close(Sb3Logits(model)(frame / 255).softmax(-1), wanted)


def test_a_trained_model_can_be_judged_although_it_holds_what_torch_does_not_copy():
    model = sb3.A2C("MlpPolicy", Still(FLOATS), n_steps=5, seed=0).learn(5)
    network = ForeignNetwork(nn.Sequential(nn.Flatten(), Sb3Logits(model)), (1, 1, 3), MOVES)
    before = network(torch.ones(1, 1, 1, 3))
    model.learn(5)
    assert torch.equal(network(torch.ones(1, 1, 1, 3)), before)


def test_a_policy_that_does_more_than_its_modules():
    model = sb3.PPO("MlpPolicy", Still(FLOATS), seed=0)
    with torch.no_grad():  # so that there is something to differ by
        model.policy.mlp_extractor.value_net[0].bias.fill_(1.0)
        model.policy.action_net.weight.mul_(100)
    model.policy.mlp_extractor.forward_actor = model.policy.mlp_extractor.forward_critic
    with pytest.raises(InputError, match=r"^the policy of PPO gives no logits of a picture alone"):
        Sb3Logits(model)


def test_a_model_without_probabilities_of_actions():
    model = sb3.DQN("MlpPolicy", Still(FLOATS), buffer_size=10)
    with pytest.raises(InputError, match=r"^the policy of DQN gives no logits of a picture"):
        Sb3Logits(model)
