"""Rates, with a simulated clock."""

import pytest

from benchmarks import pipeline
from benchmarks.pipeline import default_pipeline, make_drone_env, paired, random_walk, rate


@pytest.fixture
def clock(monkeypatch):
    """Simulate the clock; return a factory of functions that take given seconds."""
    now = [0.0]
    monkeypatch.setattr(pipeline.time, "perf_counter", lambda: now[0])

    def work(items, *seconds):
        left = list(seconds)

        def run():
            now[0] += left.pop(0) if len(left) > 1 else left[0]
            return items

        return run

    return work


def test_rate_repeats_work_until_the_time_is_up(clock):
    assert rate(clock(6, 2.0), seconds=5.0) == 18 / 6.0


def test_a_drift_of_the_machine_does_not_change_the_ratio(clock):
    # each round takes twice as long as the previous one; the ratio stays 3
    slower = (1.0, 2.0, 4.0)
    first, second, ratio = paired(clock(30, *slower), clock(10, *slower), seconds=0.5, rounds=3)
    assert (first, second, ratio) == (15.0, 5.0, 3.0)


def test_random_walk_continues_after_the_end_of_an_episode():
    env = make_drone_env(2, "cpu", num_cubes=1)
    assert random_walk(env, 40) == 80
    env.close()


def test_the_default_pipeline_acts_on_camera_images():
    env, actor, network = default_pipeline(2)
    state = actor(env.reset())
    assert state["pixels"].shape == (2, *network.in_shape)
    assert state["action"].shape == (2,)
    env.close()
