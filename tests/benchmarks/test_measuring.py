"""Statistics of times, rates and memory by hand, and trainings of a few frames."""

import pytest

from benchmarks import pipeline, revisions, scaling, startup
from benchmarks.memory import growth
from benchmarks.pipeline import paired


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


def test_a_drift_of_the_machine_does_not_change_the_ratio(clock):
    # each round takes twice as long as the previous one; the ratio stays 3
    slower = (1.0, 2.0, 4.0)
    first, second, ratio = paired(clock(30, *slower), clock(10, *slower), seconds=0.5, rounds=3)
    assert (first, second, ratio) == (15.0, 5.0, 3.0)


def test_memory_growth_ignores_samples_before_settling():
    """2 MiB in 20,000 frames after settling."""
    samples = [(0, 300.0), (50, 500.0), (100, 600.0), (10_100, 601.0), (20_100, 602.0)]
    assert growth(samples, 100) == pytest.approx(100.0)
    assert growth(samples[:4], 100) is None


def test_r_squared_is_one_for_a_straight_line_only():
    assert scaling._r_squared({1: 3.0, 2: 5.0, 4: 9.0}) == pytest.approx(1.0)
    # the fit to 0, 0, 3 at 0, 1, 2 has residual sum of squares 1.5; the total is 6
    assert scaling._r_squared({0: 0.0, 1: 0.0, 2: 3.0}) == pytest.approx(1 - 1.5 / 6)


def test_a_ratio_of_revisions_is_the_median_of_pairs():
    """The machine's speed halves and doubles again; 22 / 20 is the median of costs."""
    pairs = [
        ({"explain_s": 10.0, "collector_fps": 100.0}, {"explain_s": 12.0, "collector_fps": 80.0}),
        ({"explain_s": 20.0}, {"explain_s": 22.0, "verdict_s": 3.0}),
        ({"explain_s": 10.0}, {"explain_s": 10.5}),
    ]
    ratios = revisions.compare(pairs)
    assert ratios == pytest.approx({"explain_s": 1.1, "collector_fps": 1.25})


def test_a_training_that_ends_without_an_update_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(startup, "PROGRAM", ("python", "-c", "raise SystemExit(3)"))
    with pytest.raises(RuntimeError, match="status 3"):
        startup.first_update_seconds(tmp_path / "run", "cpu")
