"""Models of Stable-Baselines3 are copied, and refused where a single image does not decide."""

import copy

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config.transforms import Gray
from drone_rl.policies.external_policy import as_policy
from drone_rl.utils.errors import InputError
from tests.policies.sb3_models import (
    CAMERA,
    NAME,
    Playback,
    batched,
    gymnasium,
    make_model,
    of_floats,
    sb3,
)

policies = pytest.importorskip("stable_baselines3.common.policies")


@pytest.mark.parametrize("kind", ["Dropout", "BatchNorm", "normalized"])
def test_model_and_random_numbers_stay_as_they_were(kind):
    model = make_model(kind)
    model.policy.train()
    normalization = copy.deepcopy(model.get_vec_normalize_env())
    before = copy.deepcopy(model.policy.state_dict())
    states = torch.get_rng_state(), np.random.get_state()[1].copy()
    as_policy(model)
    assert all(part.training for part in model.policy.modules())
    after = model.policy.state_dict()
    assert all(torch.equal(after[name], value) for name, value in before.items())
    assert torch.equal(torch.get_rng_state(), states[0])
    assert (np.random.get_state()[1] == states[1]).all()
    if normalization is not None:
        assert (model.get_vec_normalize_env().obs_rms.mean == normalization.obs_rms.mean).all()


def test_trained_models_are_copied():
    env = batched(Gray())(gymnasium.make(NAME, camera=CAMERA))
    model = sb3.PPO("MlpPolicy", env, n_steps=4, batch_size=4, **of_floats()).learn(4)
    network = as_policy(model).make_network()
    image = torch.rand(1, 1, 40, 48, generator=torch.Generator().manual_seed(0))
    before = network(image.requires_grad_())
    model.learn(4)
    assert torch.equal(copy.deepcopy(network)(image), before)


def test_a_normalization_that_is_missing_is_refused(tmp_path):
    model, plain_env = make_model("normalized bytes"), make_model("bytes, MLP").get_env()
    with pytest.raises(InputError, match=r"^PPO was trained with VecNormalize, which its env"):
        drone_rl.policy_from(model, env=plain_env)


class Remembering(policies.ActorCriticPolicy):
    """A recurrent policy, as far as its interface goes."""

    def get_distribution(self, obs, lstm_states, episode_starts):
        raise AssertionError("it needs a state")

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.zeros(len(observation), np.int64), (np.zeros((1, len(observation), 8)),)


def test_recurrent_models_are_refused():
    model = sb3.PPO(Remembering, gymnasium.make(NAME, camera=CAMERA))
    with pytest.raises(InputError, match=r"^the policy of PPO is recurrent: it needs its state"):
        as_policy(model)


def test_models_without_logits_of_an_image_are_refused():
    space = gymnasium.spaces.Box(-1, 1, (3,), np.float32)
    env = Playback(np.zeros((1, 2, 3)))
    env.observation_space = space
    refused = [sb3.DQN("MlpPolicy", env, buffer_size=10)]
    env.observation_space = gymnasium.spaces.Dict({"a": space, "b": space})
    refused.append(sb3.PPO("MultiInputPolicy", env))
    for model in refused:
        with pytest.raises(InputError, match=r"^the policy of \w+ gives no logits of a single"):
            as_policy(model)


def test_other_values_are_no_models_and_no_environments():
    with pytest.raises(InputError, match=r"model='model.zip' is no model.*PPO\.load\(path\)"):
        drone_rl.Sb3Logits("model.zip")
    with pytest.raises(InputError, match=r"^env='venv' is no environment of Stable-Baselines3"):
        drone_rl.policy_from(make_model("bytes, CNN"), env="venv")
    with pytest.raises(InputError, match=r"^env= is of models of Stable-Baselines3"):
        drone_rl.policy_from(lambda images: images[:, :3], env="venv")
