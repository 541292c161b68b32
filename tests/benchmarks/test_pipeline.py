"""Rates, with a clock that is turned by hand."""

import pytest

from benchmarks import pipeline
from benchmarks.pipeline import default_pipeline, make_worlds, paired, random_walk, rate


@pytest.fixture
def clock(monkeypatch):
    """A clock that work turns on by the seconds it is said to take."""
    now = [0.0]
    monkeypatch.setattr(pipeline.time, "perf_counter", lambda: now[0])

    def work(items, *seconds):
        left = list(seconds)

        def run():
            now[0] += left.pop(0) if len(left) > 1 else left[0]
            return items

        return run

    return work


def test_work_is_repeated_until_the_time_is_up_and_counted_whole(clock):
    assert rate(clock(6, 2.0), seconds=5.0) == 18 / 6.0


def test_a_drift_of_the_machine_hits_both_kinds_of_work(clock):
    # each round takes twice as long as the one before; the ratio stays 3
    slower = (1.0, 2.0, 4.0)
    first, second, ratio = paired(clock(30, *slower), clock(10, *slower), seconds=0.5, rounds=3)
    assert (first, second, ratio) == (15.0, 5.0, 3.0)


def test_a_walk_goes_on_over_the_ends_of_episodes():
    env = make_worlds(2, "cpu", num_cubes=1)
    assert random_walk(env, 40) == 80
    env.close()


def test_the_default_pipeline_acts_on_what_its_camera_sees():
    env, actor, network = default_pipeline(2)
    state = actor(env.reset())
    assert state["pixels"].shape == (2, *network.in_shape)
    assert state["action"].shape == (2,)
    env.close()
