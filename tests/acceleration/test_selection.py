"""The fastest implementation that supports a configuration is chosen."""

import pytest
from torchrl.envs import RewardSum

from drone_rl.acceleration import (
    ActivationCache,
    BatchedInference,
    DirectCollector,
    DirectStream,
    FusedCollector,
    FusedNetwork,
    accelerate,
    accelerate_gradients,
    accelerate_inference,
    accelerate_stream,
)
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.policies import MLP, SmallCNN, make_actor

KEPT = [("next", "reward"), ("next", "done")]


@pytest.fixture
def make():
    made = []

    def build(*transforms):
        env = with_transforms(
            DroneEnv(2, TaskSettings(num_cubes=1, first_distance=3.0, step_limit=5)), transforms
        )
        made.append(env)
        return env, make_actor(SmallCNN((1, 25, 64), 3), env.action_spec)

    yield build
    for env in made:
        env.close()


def test_a_collector_is_fused_or_direct_or_impossible_for_reasons(make):
    env, actor = make(GrayPixels())
    assert isinstance(accelerate(env, actor, kept=KEPT), FusedCollector)
    assert isinstance(accelerate(env, actor, kept=KEPT, fused=False), DirectCollector)
    found = accelerate(env, make_actor(MLP((1, 25, 64), 3), env.action_spec), kept=KEPT)
    assert isinstance(found, DirectCollector) and found.reasons == ("network MLP is not fused",)
    found = accelerate(*make(GrayPixels(), RewardSum()), kept=KEPT)
    assert found == ("transform RewardSum is not fused",)


def test_a_stream_is_direct_or_impossible_for_reasons(make):
    assert isinstance(accelerate_stream(make(GrayPixels())[0], ["pixels"], KEPT), DirectStream)
    env, _ = make(GrayPixels(), RewardSum())
    assert accelerate_stream(env, ["pixels"], KEPT) == ("transform RewardSum is not fused",)


def test_networks():
    network = SmallCNN((1, 25, 64), 3)
    assert isinstance(accelerate_inference(network), BatchedInference)
    cache = ActivationCache(1, 1)
    found = accelerate_gradients(network, cache=lambda: cache)
    assert isinstance(found, FusedNetwork) and found.in_keys == ("pixels", "activations")
    assert accelerate_gradients(network).in_keys == ("pixels",)
    assert accelerate_gradients(MLP((1, 25, 64), 3)) == ("network MLP is not fused",)
