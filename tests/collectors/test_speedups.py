"""Without the package `drone_rl.acceleration`, collectors and networks use TorchRL and torch."""

import sys

import pytest
import torch
from torchrl.envs import RewardSum

from drone_rl.acceleration import (
    DirectCollector,
    DirectStepper,
    FusedCollector,
)
from drone_rl.collectors import speedups
from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.policies import MLP, SmallCNN, make_actor

TASK = TaskSettings(num_cubes=1, first_distance=3.0, step_limit=5)
KEPT = [("next", "reward"), ("next", "done")]


@pytest.fixture
def missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "drone_rl.acceleration", None)


def test_collectors_step_by_torchrl_if_the_package_is_missing(missing):
    env = with_transforms(DroneEnv(2, TASK), [GrayPixels()])
    network = SmallCNN((1, 25, 64), 3)
    for acceleration in ("fused", "direct"):
        actor = make_actor(network, env.action_spec)
        collector = EpisodeCollector(env, actor, acceleration=acceleration)
        name = "stepping collector: drone_rl.acceleration is not installed"
        assert collector.source.name == name
        assert collector.collect()["next", "done"].sum() == 2
    assert speedups.accelerated_stepper(env, ["pixels"], []) == speedups.MISSING
    env.close()


def test_collector_is_fused_direct_or_rejected_with_reasons():
    env = with_transforms(DroneEnv(2, TASK), [GrayPixels()])
    actor = make_actor(SmallCNN((1, 25, 64), 3), env.action_spec)
    find = speedups.accelerated_collector
    assert isinstance(find(env, actor, "fused", next_keys=KEPT), FusedCollector)
    assert isinstance(find(env, actor, "direct", next_keys=KEPT), DirectCollector)
    found = find(env, make_actor(MLP((1, 25, 64), 3), env.action_spec), "fused", next_keys=KEPT)
    assert isinstance(found, DirectCollector) and found.reasons == ("network MLP is not fused",)
    assert isinstance(speedups.accelerated_stepper(env, ["pixels"], KEPT), DirectStepper)
    summed = with_transforms(DroneEnv(2, TASK), [GrayPixels(), RewardSum()])
    reasons = ("transform RewardSum is not fused",)
    assert (
        find(summed, make_actor(SmallCNN((1, 25, 64), 3), env.action_spec), "fused", next_keys=KEPT)
        == reasons
    )
    assert speedups.accelerated_stepper(summed, ["pixels"], KEPT) == reasons
    env.close()
    summed.close()


def test_networks_are_unchanged_if_the_package_is_missing(missing):
    network = SmallCNN((1, 25, 64), 3)
    assert speedups.accelerated_gradients(network) is network
    pixels = torch.randn(2, 1, 25, 64)
    logits = speedups.accelerated_inference(network)(pixels)
    assert torch.equal(logits, network(pixels)) and not logits.requires_grad


def test_import_errors_within_the_package_propagate(monkeypatch):
    monkeypatch.delitem(sys.modules, "drone_rl.acceleration", raising=False)
    monkeypatch.setitem(sys.modules, "drone_rl.acceleration.fused_collector", None)
    with pytest.raises(ModuleNotFoundError, match="fused_collector"):
        speedups.accelerated_inference(torch.nn.Identity())
