"""Models of Stable-Baselines3 act as by their own `predict`, on every frame of the same episodes.

The library's actions come from its own vector environments and wrappers, which replay the frames.
"""

import copy

import numpy as np
import pytest
import torch
from torch import nn

import drone_rl
from drone_rl.config.transforms import Gray, Rgb, Standardize
from drone_rl.envs import base_env
from drone_rl.policies.external_policy import as_policy
from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from gymnasium import wrappers  # noqa: E402 (after the skip)
from stable_baselines3.common.policies import ActorCriticPolicy  # noqa: E402
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor  # noqa: E402
from stable_baselines3.common.vec_env import (  # noqa: E402
    DummyVecEnv,
    VecEnvWrapper,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)

NAME = "drone_rl/CollectCubes-v0"
CAMERA = drone_rl.CameraSettings(width=48, height=40, horizontal_fov=100.0)
TASK = {"num_cubes": 2}
STEPS = 8


class Playback(gymnasium.Env):
    """An environment that shows recorded episodes one after the other."""

    action_space = gymnasium.spaces.Discrete(3)

    def __init__(self, episodes):
        self.frames = np.asarray(episodes)
        self.observation_space = gymnasium.spaces.Box(0, 255, self.frames.shape[2:], np.uint8)
        self.episode, self.step_number = -1, 0

    def reset(self, *, seed=None, options=None):
        self.episode, self.step_number = (self.episode + 1) % len(self.frames), 0
        return self.frames[self.episode, 0], {}

    def step(self, action):
        self.step_number += 1
        last = self.step_number == self.frames.shape[1]
        shown = self.frames[self.episode, self.step_number - last]
        return shown, 0.0, last, False, {}


class Layers(BaseFeaturesExtractor):
    """A features extractor of the user's own, with some layer between convolution and output."""

    def __init__(self, observation_space, layer=nn.Identity):
        super().__init__(observation_space, features_dim=16)
        channels = observation_space.shape[0]
        self.layers = nn.Sequential(
            nn.Conv2d(channels, 4, 5, 4), layer(), nn.ReLU(), nn.Flatten(), nn.LazyLinear(16)
        )
        self.layers(torch.zeros(2, *observation_space.shape))

    def forward(self, observations):
        return self.layers(observations)


def norm():
    """Return a normalization with statistics that differ from those of a batch."""
    layer = nn.BatchNorm2d(4)
    layer.running_mean[:], layer.running_var[:] = torch.tensor([0.1, -0.2, 0.3, 0.0]), 0.5
    return layer


def single(*layers):
    """Return what makes a vector environment of Gymnasium environments with these wrappers."""

    def make(env):
        for layer in layers:
            env = layer(env)
        return DummyVecEnv([lambda: env])

    return make


def batched(*transforms):
    def make(env):
        given = gymnasium.vector.SyncVectorEnv([lambda: env], autoreset_mode="SameStep")
        return drone_rl.Sb3Worlds(given, transforms)

    return make


def channels_first(env):
    space = gymnasium.spaces.Box(0, 255, (3, CAMERA.height, CAMERA.width), np.uint8)
    return wrappers.TransformObservation(env, lambda x: np.moveaxis(x, -1, 0), space)


def floats(env):
    space = gymnasium.spaces.Box(0, 1, (CAMERA.height, CAMERA.width, 3), np.float32)
    return wrappers.TransformObservation(env, lambda x: x / np.float32(255), space)


def gray(env):
    return wrappers.GrayscaleObservation(env, keep_dim=True)


def plain(env):
    return env


def stacked(env):
    return VecFrameStack(env, 3)


def normalized(env):
    return VecNormalize(env, clip_obs=1.5)


def with_layer(layer):
    given = {"features_extractor_class": Layers, "features_extractor_kwargs": {"layer": layer}}
    return {"policy_kwargs": given}


def of_floats(**given):
    return {"policy_kwargs": {"normalize_images": False, **given}}


KINDS = {
    "bytes, MLP": ("MlpPolicy", single(), plain, {}),
    "bytes, CNN": ("CnnPolicy", single(), plain, {}),
    "bytes, CNN, not scaled": ("CnnPolicy", single(), plain, of_floats()),
    "bytes, channels first": ("CnnPolicy", single(channels_first), plain, {}),
    "floats, channels last": ("MlpPolicy", single(floats), plain, {}),
    "floats, channels first": ("CnnPolicy", batched(Gray(), Standardize()), plain, of_floats()),
    "gray": ("CnnPolicy", single(gray), plain, {}),
    "flat": ("MlpPolicy", single(wrappers.FlattenObservation), plain, {}),
    "stacked": ("CnnPolicy", single(), stacked, {}),
    "stacked side by side": ("MlpPolicy", batched(Gray()), stacked, of_floats()),
    "normalized": ("MlpPolicy", batched(Gray()), normalized, of_floats()),
    "normalized bytes": ("MlpPolicy", single(), normalized, of_floats()),
    "gray, stacked, normalized": (
        "MlpPolicy",
        single(gray),
        lambda env: VecMonitor(normalized(stacked(env))),
        of_floats(),
    ),
    "Dropout": ("CnnPolicy", single(), plain, with_layer(nn.Dropout)),
    "BatchNorm": ("CnnPolicy", single(), plain, with_layer(norm)),
    "own features extractor": ("CnnPolicy", single(), plain, with_layer(nn.Tanh)),
}


def latent(policy, seen):
    """Return the input of the last layer."""
    features = policy.extract_features(seen, policy.pi_features_extractor)
    return policy.mlp_extractor.forward_actor(features)


def make_model(kind):
    """Return a model with random weights whose actions differ between frames."""
    policy, inner, outer, options = KINDS[kind]
    env = outer(inner(gymnasium.make(NAME, camera=CAMERA, **TASK)))
    env.seed(1)
    model = sb3.PPO(policy, env, seed=0, n_steps=4, batch_size=4, **options)
    env = model.get_env()
    seen = [env.reset(), *(env.step(np.array([i % 3]))[0] for i in range(12))]
    layer = model.policy.action_net
    with torch.no_grad():
        layer.weight.normal_(generator=torch.Generator().manual_seed(3))
        policy = copy.deepcopy(model.policy).eval()
        given, _ = policy.obs_to_tensor(np.concatenate(seen))
        spread, mean = torch.std_mean(layer.weight @ latent(policy, given).T, 1)
        layer.weight /= spread[:, None]
        layer.bias.copy_(-mean / spread)
    return model


def library_actions(model, kind, episodes):
    """Return the actions of `predict` in episodes (E, T, H, W, 3), shape (E, T)."""
    _, inner, outer, _ = KINDS[kind]
    model = copy.copy(model)
    env = outer(inner(Playback(episodes)))
    if (own := model.get_vec_normalize_env()) is not None:
        while not isinstance(env, VecNormalize):
            env = env.venv
        env.obs_rms, env.training = own.obs_rms, False
    seen, actions = env.reset(), []
    for _ in range(episodes.shape[0] * episodes.shape[1]):
        action, _ = model.predict(seen, deterministic=True)
        actions.append(int(action[0]))
        seen, _, _, _ = env.step(action)
    return np.reshape(actions, episodes.shape[:2])


@pytest.mark.parametrize("kind", KINDS)
def test_actions_equal_those_of_predict_on_every_frame(kind):
    model = make_model(kind)
    policy = as_policy(model)
    frames, actions = [], []
    with policy.flying(4, seed=5) as (env, _):
        network = policy.make_network()
        for _ in range(2):
            state, shown, taken = env.reset(), [], []
            for step in range(STEPS):
                shown.append(base_env(env).last_pixels.clone())
                taken.append(network(state["pixels"]).argmax(-1))
                other = torch.tensor([0, 1, 2, step % 3])
                state = env.step(state.set("action", other))["next"]
            frames.append(torch.stack(shown, 1))
            actions.append(torch.stack(taken, 1))
    frames, actions = torch.cat(frames).numpy(), torch.cat(actions).numpy()
    assert (actions == library_actions(model, kind, frames)).all()
    assert len(np.unique(actions)) > 1  # else any observations would do
    assert network.is_differentiable


def test_task_and_camera_are_those_of_the_environment():
    policy = as_policy(make_model("gray"))
    assert (policy.name, policy.camera) == ("PPO of Stable-Baselines3", CAMERA)
    assert policy.task == drone_rl.TaskSettings(**TASK)
    given = drone_rl.policy_from(
        make_model("bytes, CNN"), task=drone_rl.TaskSettings(num_cubes=1), name="mine"
    )
    assert (given.name, given.task.num_cubes, given.transforms) == ("mine", 1, (Rgb(),))


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


def reload(model, folder, env=None):
    model.save(folder / "model.zip")
    return sb3.PPO.load(folder / "model.zip", env=env)


def test_loaded_models_need_their_environment_unless_they_observe_color(tmp_path):
    color = as_policy(reload(make_model("bytes, CNN"), tmp_path))
    size = (CAMERA.height, CAMERA.width)
    assert (color.camera.height, color.camera.width, color.transforms) == (*size, (Rgb(),))
    for kind, shape in (("normalized bytes", "40, 48, 3"), ("stacked", "9, 40, 48")):
        model = make_model(kind)
        loaded = reload(model, tmp_path)
        with pytest.raises(InputError, match=rf"shape \({shape}\).*no environment .* give .* env="):
            as_policy(loaded)
        policy = drone_rl.policy_from(loaded, env=model.get_env())
        assert policy.make_network().in_shape == (int(shape[0]) if shape[1] == "," else 3, *size)


def test_a_normalization_that_is_missing_is_refused(tmp_path):
    model, plain_env = make_model("normalized bytes"), make_model("bytes, MLP").get_env()
    with pytest.raises(InputError, match=r"^PPO was trained with VecNormalize, which its env"):
        drone_rl.policy_from(model, env=plain_env)


class Remembering(ActorCriticPolicy):
    """A recurrent policy, as far as its interface goes."""

    def get_distribution(self, obs, lstm_states, episode_starts):
        raise AssertionError("it needs a state")

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.zeros(len(observation), np.int64), (np.zeros((1, len(observation), 8)),)


def test_recurrent_models_are_refused():
    model = sb3.PPO(Remembering, gymnasium.make(NAME, camera=CAMERA))
    with pytest.raises(InputError, match=r"^the policy of PPO is recurrent: it needs its state"):
        as_policy(model)


class Brighter(VecEnvWrapper):
    """A wrapper of the user's own, which only a run can show."""

    def reset(self):
        return self.venv.reset() / np.float32(200)

    def step_wait(self):
        seen, *rest = self.venv.step_wait()
        return seen / np.float32(200), *rest


def own_wrapper(outer=plain):
    env = outer(Brighter(single()(gymnasium.make(NAME, camera=CAMERA))))
    env.observation_space = gymnasium.spaces.Box(0, 2, (40, 48, 3), np.float32)
    return sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4)


def test_unknown_wrappers_need_transforms():
    model = own_wrapper()
    with pytest.raises(InputError, match=r"\(it has Brighter\); give drone_rl\.policy_from env="):
        as_policy(model)
    policy = drone_rl.policy_from(model, transforms=[Rgb(), Standardize(mean=0.0, std=200 / 255)])
    assert policy.make_network().in_shape == (3, 40, 48)


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


def test_state_observations_are_no_images():
    env = gymnasium.make(NAME, observations="state")
    model = sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4)
    with pytest.raises(InputError, match="observes the ground truth instead of images"):
        as_policy(model)
