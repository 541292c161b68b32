"""Workers on a local Ray cluster: the same episodes as on threads, whatever happens to a worker."""

import logging

import pytest
import torch
from hydra import compose, initialize_config_dir

from drone_rl.cli.build import build_collector
from drone_rl.cli.main import conf_dir
from drone_rl.configs import register_configs
from drone_rl.training.metrics import episode_rewards
from drone_rl.utils.errors import InputError

pytestmark = pytest.mark.slow
ray = pytest.importorskip("ray", reason="pip install 'drone-rl[ray]'")


@pytest.fixture(scope="module", autouse=True)
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def build(*overrides):
    register_configs()
    with initialize_config_dir(str(conf_dir()), version_base="1.3"):
        settings = ["experiment=smoke", "logger=csv", "collector.num_envs=6", *overrides]
        return build_collector(compose("train", settings))[0]


@pytest.fixture
def on_ray():
    collector = build("collector=ray")
    yield collector
    collector.shutdown()


@pytest.fixture
def on_threads():
    collector = build("collector.num_threads=2")
    yield collector
    collector.shutdown()


def assert_same(one, two):
    for key in ("pixels", "action", ("next", "reward"), ("next", "done")):
        assert torch.equal(one[key], two[key]), key


def test_same_complete_episodes_as_on_threads_and_a_killed_worker_changes_nothing(
    on_ray, on_threads, caplog
):
    first = on_ray.collect()
    assert_same(first, on_threads.collect())
    assert len(episode_rewards(first)) == 6
    assert first["next", "done"][-1].all()
    state = on_ray.state_dict()
    with caplog.at_level(logging.WARNING):
        ray.kill(on_ray.workers[0])
        second = on_ray.collect()
    assert "another flies its unfinished episodes" in caplog.text
    assert_same(second, on_threads.collect())
    on_ray.load_state_dict(state)
    assert_same(on_ray.collect(), second)
    on_ray._left = 0
    ray.kill(on_ray.workers[1])
    with pytest.raises(InputError, match=r"workers were lost.*resume"):
        on_ray.collect()


def test_more_workers_than_cores():
    with pytest.raises(InputError, match=r"num_threads=4.*more than the cluster's 2 cores"):
        build("collector=ray", "collector.num_threads=4")
