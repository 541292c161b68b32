"""Logits of Stable-Baselines3 models, compared with hand-computed ones and the model."""

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.policies import ExternalNetwork
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from drone_rl.policies.sb3 import Sb3Logits, _channels_first  # noqa: E402 (after the skip)


class StaticEnv(gymnasium.Env):
    """An environment without dynamics."""

    action_space = gymnasium.spaces.Discrete(3)

    def __init__(self, space):
        self.observation_space = space

    def reset(self, *, seed=None, options=None):
        return self.observation_space.sample(), {}

    def step(self, action):
        return self.observation_space.sample(), float(action), False, False, {}


BYTES = gymnasium.spaces.Box(0, 255, (40, 48, 3), np.uint8)
FLOATS = gymnasium.spaces.Box(-1, 1, (3,), np.float32)


def test_byte_observations_are_scaled_from_0_to_1():
    model = sb3.A2C("CnnPolicy", StaticEnv(BYTES), seed=0)
    frames = np.stack([BYTES.sample() for _ in range(4)])
    images = torch.from_numpy(frames).movedim(-1, 1).float() / 255
    probabilities = Sb3Logits(model)(images).softmax(-1)
    bytes_first = torch.from_numpy(frames).movedim(-1, 1)
    wanted = model.policy.get_distribution(bytes_first).distribution.probs
    torch.testing.assert_close(probabilities, wanted)
    images.requires_grad_()
    (gradient,) = torch.autograd.grad(Sb3Logits(model)(images)[:, 0].sum(), images)
    assert gradient.abs().sum() > 0


@pytest.mark.parametrize(
    ("space", "shape", "is_bytes"),
    [
        (BYTES, (3, 40, 48), True),
        (gymnasium.spaces.Box(0, 255, (3, 40, 48), np.uint8), (3, 40, 48), True),
        (gymnasium.spaces.Box(-1, 1, (1, 40, 48), np.float32), (1, 40, 48), False),
    ],
)
def test_observation_shape_and_type_are_read_from_the_model(space, shape, is_bytes):
    kwargs = {"normalize_images": is_bytes}
    model = sb3.A2C(
        "CnnPolicy" if is_bytes else "MlpPolicy", StaticEnv(space), policy_kwargs=kwargs
    )
    logits = Sb3Logits(model)
    assert (logits.observation_shape, logits.observes_bytes) == (shape, is_bytes)


def test_float_observations_are_unchanged():
    model = sb3.PPO("MlpPolicy", StaticEnv(FLOATS), seed=0, policy_kwargs={"net_arch": []})
    with torch.no_grad():
        model.policy.action_net.weight.copy_(torch.eye(3))
        model.policy.action_net.bias.zero_()
    assert Sb3Logits(model).observation_shape is None
    probabilities = Sb3Logits(model)(torch.tensor([[0.0, 1.0, -1.0]])).softmax(-1)
    torch.testing.assert_close(probabilities, torch.tensor([[0.0, 1.0, -1.0]]).softmax(-1))


def test_unnormalized_byte_observations_are_supported():
    kwargs = {"normalize_images": False}
    model = sb3.A2C("CnnPolicy", StaticEnv(BYTES), seed=0, policy_kwargs=kwargs)
    frame = torch.from_numpy(BYTES.sample()).movedim(-1, 0)[None]
    wanted = model.policy.get_distribution(frame.float()).distribution.probs
    torch.testing.assert_close(Sb3Logits(model)(frame / 255).softmax(-1), wanted)


def test_trained_model_is_copied():
    model = sb3.A2C("MlpPolicy", StaticEnv(FLOATS), n_steps=5, seed=0).learn(5)
    network = ExternalNetwork(nn.Sequential(nn.Flatten(), Sb3Logits(model)), (1, 1, 3), MOVES)
    before = network(torch.ones(1, 1, 1, 3))
    model.learn(5)
    assert torch.equal(network(torch.ones(1, 1, 1, 3)), before)


def test_policy_with_custom_forward_raises():
    model = sb3.PPO("MlpPolicy", StaticEnv(FLOATS), seed=0)
    with torch.no_grad():  # so that the two networks differ
        model.policy.mlp_extractor.value_net[0].bias.fill_(1.0)
        model.policy.action_net.weight.mul_(100)
    model.policy.mlp_extractor.forward_actor = model.policy.mlp_extractor.forward_critic
    with pytest.raises(InputError, match=r"^the policy of PPO gives no logits of a single image"):
        Sb3Logits(model)


def test_a_path_is_no_model():
    with pytest.raises(InputError, match=r"model='model.zip' is no model.*PPO\.load\(path\)"):
        Sb3Logits("model.zip")


def test_model_without_action_probabilities_raises():
    model = sb3.DQN("MlpPolicy", StaticEnv(FLOATS), buffer_size=10)
    with pytest.raises(InputError, match=r"^the policy of DQN gives no logits of a single image"):
        Sb3Logits(model)


def test_model_of_several_observations_raises():
    space = gymnasium.spaces.Dict({"a": FLOATS, "b": FLOATS})
    model = sb3.PPO("MultiInputPolicy", StaticEnv(space), seed=0)
    with pytest.raises(InputError, match=r"^the policy of PPO gives no logits of a single image"):
        Sb3Logits(model)


def test_model_that_scales_features_itself_raises():
    """Its logits of a black image are the same."""
    model = sb3.PPO("MlpPolicy", StaticEnv(FLOATS), seed=0)
    network = model.policy.mlp_extractor
    network.forward_actor = lambda features: network.policy_net(0.5 * features)
    with torch.no_grad():
        model.policy.action_net.weight.mul_(100)
    with pytest.raises(InputError, match=r"^the policy of PPO gives no logits of a single image"):
        Sb3Logits(model)


def test_the_smaller_end_of_a_shape_is_the_channels():
    assert _channels_first((40, 48, 3)) == (3, 40, 48)
    assert _channels_first((3, 40, 48)) == (3, 40, 48)
    assert _channels_first((3, 5, 3)) == (3, 5, 3)  # either; as it is
    assert _channels_first((40, 48)) is None
