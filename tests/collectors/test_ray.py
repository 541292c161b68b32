"""Ray workers collect the same episodes as threads, also after a worker fails."""

import logging

import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.config.learning import Episodes, Ray
from drone_rl.config.training import TrainSettings
from drone_rl.training.metrics import episode_rewards
from drone_rl.training.train import make_collector
from drone_rl.utils.errors import InputError

pytestmark = pytest.mark.slow
ray = pytest.importorskip("ray", reason="pip install -e '.[ray]'")

TASK = TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60)


@pytest.fixture(scope="module", autouse=True)
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def build(collector):
    return make_collector(TrainSettings(task=TASK, collector=collector)).collector


@pytest.fixture
def on_ray():
    collector = build(Ray(num_envs=6))
    yield collector
    collector.shutdown()


@pytest.fixture
def on_threads():
    collector = build(Episodes(num_envs=6, num_threads=2))
    yield collector
    collector.shutdown()


def assert_same(one, two):
    for key in ("pixels", "action", ("next", "reward"), ("next", "done")):
        assert torch.equal(one[key], two[key]), key


def test_episodes_equal_those_of_threads_also_after_a_worker_is_killed(on_ray, on_threads, caplog):
    first = on_ray.collect()
    assert_same(first, on_threads.collect())
    assert len(episode_rewards(first)) == 6
    assert first["next", "done"][-1].all()
    state = on_ray.state_dict()
    with caplog.at_level(logging.WARNING):
        ray.kill(on_ray.workers[0])
        second = on_ray.collect()
    assert "another runs its unfinished episodes" in caplog.text
    assert_same(second, on_threads.collect())
    on_ray.load_state_dict(state)
    assert_same(on_ray.collect(), second)
    on_ray._left = 0
    ray.kill(on_ray.workers[1])
    with pytest.raises(InputError, match=r"workers were lost.*resume"):
        on_ray.collect()


@pytest.mark.parametrize(("workers", "cores"), [(3, 1.0), (2, 1.5)])
def test_more_workers_than_cores_raise(workers, cores, monkeypatch):
    ends = []
    monkeypatch.setattr(ray, "shutdown", lambda: ends.append(ray))  # other tests need the cluster
    message = rf"num_threads={workers} workers .*more than the cluster's 2 cores"
    with pytest.raises(InputError, match=message):
        build(Ray(num_envs=6, num_threads=workers, num_cpus=cores))
    assert ends == []  # the cluster is the caller's
    monkeypatch.setattr(ray, "is_initialized", lambda: False)
    monkeypatch.setattr(ray, "init", lambda **settings: None)
    with pytest.raises(InputError, match=message):
        build(Ray(num_envs=6, num_threads=workers, num_cpus=cores))
    assert ends == [ray]
