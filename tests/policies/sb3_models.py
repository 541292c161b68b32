"""Models of Stable-Baselines3 of many kinds, with random weights."""

import copy

import numpy as np
import pytest
import torch
from torch import nn

import drone_rl
from drone_rl.config.transforms import Gray, Stack, Standardize
from drone_rl.envs import Pipeline

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from gymnasium import wrappers  # noqa: E402 (after the skip)
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor  # noqa: E402
from stable_baselines3.common.vec_env import (  # noqa: E402
    DummyVecEnv,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)

NAME = "drone_rl/CollectCubes-v0"
CAMERA = drone_rl.CameraSettings(width=48, height=40, horizontal_fov=100.0)
TASK = {"num_cubes": 2}


class Playback(gymnasium.Env):
    """An environment that shows recorded episodes one after the other."""

    action_space = gymnasium.spaces.Discrete(3)

    def __init__(self, episodes):
        self.frames = np.asarray(episodes)
        shape, dtype = self.frames.shape[2:], self.frames.dtype
        self.observation_space = gymnasium.spaces.Box(0, 255, shape, dtype.type)
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


def batched(env):
    return drone_rl.Sb3Worlds(
        gymnasium.vector.SyncVectorEnv([lambda: env], autoreset_mode="SameStep")
    )


def channels_first(env):
    space = gymnasium.spaces.Box(0, 255, (3, CAMERA.height, CAMERA.width), np.uint8)
    return wrappers.TransformObservation(env, lambda x: np.moveaxis(x, -1, 0), space)


def floats(env):
    space = gymnasium.spaces.Box(0, 1, (CAMERA.height, CAMERA.width, 3), np.float32)
    return wrappers.TransformObservation(env, lambda x: x / np.float32(255), space)


class Inverted(gymnasium.ObservationWrapper):
    """A wrapper of the user's own, which reads the spaces of itself and of its environment."""

    def observation(self, observation):
        low = self.env.observation_space.low
        return (self.observation_space.high - observation + low).astype(np.uint8)


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
    "floats, channels first": ("CnnPolicy", batched, plain, of_floats()),
    "own wrapper": ("CnnPolicy", single(Inverted), plain, {}),
    "gray": ("CnnPolicy", single(gray), plain, {}),
    "flat": ("MlpPolicy", single(wrappers.FlattenObservation), plain, {}),
    "stacked": ("CnnPolicy", single(), stacked, {}),
    "stacked side by side": ("MlpPolicy", batched, stacked, of_floats()),
    "stack of the environment": ("MlpPolicy", batched, plain, of_floats()),
    "normalized": ("MlpPolicy", batched, normalized, of_floats()),
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
TRANSFORMS = {
    "floats, channels first": (Gray(), Standardize()),
    "stacked side by side": (Gray(),),
    "stack of the environment": (Gray(), Stack()),
    "normalized": (Gray(),),
}
"""Transforms of the environments of some kinds."""


def latent(policy, seen):
    """Return the input of the last layer."""
    features = policy.extract_features(seen, policy.pi_features_extractor)
    return policy.mlp_extractor.forward_actor(features)


def make_model(kind):
    """Return a model with random weights whose actions differ between frames."""
    policy, inner, outer, options = KINDS[kind]
    given = TRANSFORMS.get(kind, ())
    env = outer(inner(gymnasium.make(NAME, camera=CAMERA, transforms=given, **TASK)))
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


def seen_by(transforms, episodes):
    """Apply transforms to episodes (E, T, H, W, 3), one frame after the other."""
    pipeline = Pipeline([transform.make() for transform in transforms])
    frames = torch.as_tensor(episodes).unbind(1)
    return torch.stack([pipeline(one, starts=not t) for t, one in enumerate(frames)], 1).numpy()


def library_actions(model, kind, episodes):
    """Return the actions of `predict` in episodes (E, T, H, W, 3), shape (E, T)."""
    _, inner, outer, _ = KINDS[kind]
    model = copy.copy(model)
    env = outer(inner(Playback(seen_by(TRANSFORMS.get(kind, ()), episodes))))
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
