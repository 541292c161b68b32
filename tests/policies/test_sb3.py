import copy

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config.networks import Mlp, SmallCnn
from drone_rl.config.transforms import Gray, Rgb, Standardize
from drone_rl.policies.external_policy import as_policy
from drone_rl.utils.errors import InputError
from tests.policies.sb3_models import (
    CAMERA,
    NAME,
    Playback,
    gymnasium,
    make_model,
    sb3,
    single,
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
    with pytest.raises(InputError, match=r"^the policy of \w+ gives no logits of images"):
        as_policy(sb3.DQN("MlpPolicy", env, buffer_size=10))
    env.observation_space = gymnasium.spaces.Dict({"a": space, "b": space})
    with pytest.raises(InputError, match=r"^Playback is no environment of drone_rl"):
        as_policy(sb3.PPO("MultiInputPolicy", env))


def test_other_values_are_no_models_and_no_environments():
    with pytest.raises(InputError, match=r"model='model.zip' is no model.*PPO\.load\(path\)"):
        drone_rl.Sb3Logits("model.zip")
    with pytest.raises(InputError, match=r"^env='venv' is no environment of Stable-Baselines3"):
        drone_rl.policy_from(make_model("bytes, CNN"), env="venv")
    with pytest.raises(InputError, match=r"^env= is of models of Stable-Baselines3"):
        drone_rl.policy_from(lambda images: images[:, :3], env="venv")


spaces = gymnasium.spaces

IMAGES = spaces.Box(-np.inf, np.inf, (1, 25, 64), np.float32)


def test_trunk_has_the_layers_before_the_logits():
    trunk, network = drone_rl.Sb3Trunk(IMAGES), SmallCnn().make((1, 25, 64), 3)
    names = [name for name, _ in trunk.layers.named_children()]
    assert [*names, "logits"] == [name for name, _ in network.layers.named_children()]
    trunk.layers.load_state_dict(network.layers[:-1].state_dict())
    x = torch.randn(5, 1, 25, 64)
    assert trunk(x).shape == (5, 128) == (5, trunk.features_dim)
    torch.testing.assert_close(network.layers[-1](trunk(x)), network(x))


def test_other_networks_are_supported():
    assert drone_rl.Sb3Trunk(IMAGES, Mlp(hidden=(7, 5))).features_dim == 5
    assert drone_rl.Sb3Trunk(IMAGES, SmallCnn(channels=(4,), hidden=())).features_dim == 4 * 6 * 16


def test_vector_observations_raise():
    with pytest.raises(InputError, match=r"^Sb3Trunk got observations of shape \(28,\); give ima"):
        drone_rl.Sb3Trunk(spaces.Box(0, 1, (28,)))


def test_batches_of_several_frames_are_tried():
    with pytest.raises(InputError, match=r"on images of shape \(2, 1, 25, 64\)"):
        drone_rl.policy_from(lambda images: images.reshape(1, 1, 25, 64)[:, 0, 10, :3])

    def mean_of_batch(images):
        return images[:, 0, 10, :3] + 10 * images.mean()

    with pytest.raises(InputError, match=r"^policy=mean_of_batch gives other logits .* a batch of"):
        drone_rl.policy_from(mean_of_batch)


class Late(gymnasium.ObservationWrapper):
    """The observation of the step before."""

    def __init__(self, env):
        super().__init__(env)
        self.before = None

    def observation(self, observation):
        seen, self.before = self.before, observation
        return observation if seen is None else seen


def test_wrappers_with_memory_are_refused():
    env = single(Late)(gymnasium.make(NAME, camera=CAMERA))
    model = sb3.PPO("CnnPolicy", env, seed=0, n_steps=4, batch_size=4)
    with torch.no_grad():
        model.policy.action_net.weight.mul_(1000)
    with pytest.raises(InputError, match=r"acts otherwise than by its library.*: Late, VecTransp"):
        as_policy(model)


def test_transforms_that_are_not_those_of_the_environment_are_refused():
    model = make_model("floats, channels first")
    right, wrong = (Gray(), Standardize()), (Gray(), Standardize(mean=0.2))
    assert drone_rl.policy_from(model, transforms=right).transforms == right
    with pytest.raises(InputError, match="acts otherwise than by its library's predict"):
        drone_rl.policy_from(model, transforms=wrong)
    with pytest.raises(InputError, match=r"observes \(1, 40, 48\), .* return images of \(3, 40, 4"):
        drone_rl.policy_from(model, transforms=[Rgb()])
