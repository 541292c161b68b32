"""A small policy with known weights, a few frames of it, and the scenes they came from."""

import pytest
import torch

from drone_rl.explanations.recording import record
from drone_rl.explanations.scenes import Scenes


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
    return record(env, actor, network, 60, layers=("relu1", "fc_relu1"), meta={"from": "a test"})
