"""Distribution of environments over workers does not change environments and actions."""

import pytest
import torch

from drone_rl.collectors import ThreadedCollector
from drone_rl.config import TaskSettings
from drone_rl.config.learning import Episodes, Ray
from drone_rl.config.training import TrainSettings
from drone_rl.training.train import group_sizes, make_collector

TASK = TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60)


def collected(**settings):
    made = make_collector(TrainSettings(task=TASK, **settings))
    batch = made.collector.collect()
    made.collector.shutdown()
    return made, batch


@pytest.mark.parametrize(
    ("collector", "device", "shares"),
    [
        (Episodes(num_envs=7, num_threads=3), "cpu", [3, 2, 2]),
        (Episodes(num_envs=2, num_threads=5), "cpu", [1, 1]),
        (Episodes(num_envs=6, num_threads=2), "cuda:0", [6]),
        (Episodes(num_envs=4, num_threads=4), "cpu", [1] * 4),
        (Ray(num_envs=3, num_threads=2), "cuda", [2, 1]),
    ],
)
def test_environments_are_split_evenly(collector, device, shares):
    assert group_sizes(TrainSettings(collector=collector, device=device)) == shares


def test_threads_share_a_network_but_not_random_streams():
    made, batch = collected(collector=Episodes(num_envs=5, num_threads=2))
    assert isinstance(made.collector, ThreadedCollector)
    assert list(made.generators) == ["actions_0", "actions_1"]
    assert int(batch["next", "done"].sum()) == 5
    for collector in made.collector.collectors:
        assert collector.actor.module[0].module is made.network


def test_seed_determines_network_and_batch():
    (one, first), (two, again) = (collected(collector=Episodes(num_envs=3)) for _ in range(2))
    assert torch.equal(first["action"], again["action"])
    weights, same = one.network.state_dict(), two.network.state_dict()
    assert all(torch.equal(weights[name], same[name]) for name in weights)
    other = collected(collector=Episodes(num_envs=3), seed=1)[0].network.state_dict()
    assert not any(torch.equal(weights[n], other[n]) for n in weights if n.endswith("weight"))
