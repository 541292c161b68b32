"""A small policy with known weights, a few frames of it, and the scenes they came from."""

import pytest
import torch

from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.explanations.context import Context
from drone_rl.explanations.rollouts import collect, render_frames, select_frames
from drone_rl.explanations.scenes import Scenes
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import SmallCNN


@pytest.fixture
def world(make_pipeline):
    """An environment, an actor and its network."""
    env, actor = make_pipeline(num_envs=4)
    with torch.no_grad():  # a policy with opinions, or every map would be nearly flat
        actor.module[0].module.layers.logits.weight.mul_(300)
    return env, actor, actor.module[0].module


@pytest.fixture
def scenes(world):
    return Scenes(world[0])


@pytest.fixture
def dataset(world):
    env, actor, network = world
    flights = collect(env, actor, num_episodes=1, num_frames=60)
    rows = select_frames(flights.episode, 60)
    return render_frames(flights, rows, Scenes(env), network, ("relu1", "fc_relu1"))


@pytest.fixture(scope="package")
def context():
    """The context of a small untrained policy, shared by the sections as in the program."""
    env = DroneEnv(8, seed=5, transforms=[GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,), generator=generator)
    with torch.no_grad():  # a policy with opinions, or every map would be nearly flat
        network.layers.logits.weight.mul_(300)
    settings = ExplainSettings(frames=40, episodes=6, perplexity=5, good_share=0.7, seed=3)
    yield Context(env, network, settings)
    env.close()
