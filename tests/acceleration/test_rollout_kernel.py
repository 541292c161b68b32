"""Functions of the rollout kernel, with hand-computed numbers."""

import math

import pytest
import torch
import warp as wp

from drone_rl.acceleration import FusedEpisodes
from drone_rl.acceleration.rollout_kernel import choose, standardise
from drone_rl.collectors import EpisodeCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.policies import SmallCNN, make_actor
from drone_rl.sim.rendering.devices import start_warp

INFO = ("next", "info", "collected")
start_warp("cpu")


@wp.kernel(enable_backward=False)
def chosen(
    logits: wp.array(dtype=float), draws: wp.array(dtype=float), actions: wp.array(dtype=int)
) -> None:
    i = wp.tid()
    actions[i] = choose(logits, 2, 3, draws[i])


@wp.kernel(enable_backward=False)
def standardised(values: wp.array(dtype=float), mean: float, deviation: float) -> None:
    standardise(values, values.shape[0], mean, deviation)


def actions(logits, draws):
    made = torch.full((len(draws),), -1, dtype=torch.int32)
    logits = torch.tensor([9.0, 9.0, *logits, 9.0])
    inputs = [wp.from_torch(v) for v in (logits, torch.tensor(draws), made)]
    wp.launch(chosen, len(draws), inputs=inputs, device="cpu")
    return made.tolist()


@pytest.mark.parametrize("offset", [0.0, 500.0, -500.0])
def test_sampled_action_follows_from_cumulative_probabilities(offset):
    # probabilities 0.2, 0.5, 0.3; the thresholds are 0.2 and 0.7
    logits = [math.log(p) + offset for p in (0.2, 0.5, 0.3)]
    draws = [0.0, 0.19, 0.21, 0.5, 0.69, 0.71, 0.9999]
    assert actions(logits, draws) == [0, 0, 1, 1, 1, 2, 2]


def test_greedy_action_is_the_first_most_probable():
    assert actions([1.0, 3.0, 2.0], [-1.0]) == [1]
    assert actions([1.0, 2.0, 3.0], [-1.0]) == [2]
    assert actions([3.0, 2.0, 3.0], [-1.0]) == [0]


def test_standardization_equals_the_transform_bit_for_bit():
    values = torch.rand(1000)
    expected = StandardizePixels()._apply_transform(values)
    inputs = [wp.from_torch(values), 0.53, 0.21]
    wp.launch(standardised, 1, inputs=inputs, device="cpu")
    assert torch.equal(values, expected)


@pytest.mark.parametrize("worth", [1.0, 0.5])
def test_kernel_runs_the_rules_of_the_task(worth):
    task = TaskSettings(reward={"reached": worth})
    env = DroneEnv(4, task, transforms=[GrayPixels(), StandardizePixels()])
    shape = tuple(env.observation_spec["pixels"].shape[1:])
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN(shape, 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    collector = EpisodeCollector(env, actor, compiled=True, info=("collected",))
    assert isinstance(collector.fused, FusedEpisodes)
    for _ in range(3):
        batch = collector.collect()
        first = torch.cat([torch.tensor([True]), batch["next", "done"][:-1, 0]])
        before = batch[INFO].sum(-1).roll(1).masked_fill(first, 0)
        assert torch.equal(batch["next", "reward"][:, 0], worth * (batch[INFO].sum(-1) - before))
    assert float(batch["next", "reward"].max()) == worth
