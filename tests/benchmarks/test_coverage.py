import numpy as np
import pytest
from scipy.stats import binom

from benchmarks import coverage, simulated_policies
from drone_rl.utils.intervals import proportion


def test_coverage_is_exact():
    """Two tosses of a fair coin: the mean is a half with probability 0.5."""
    coin = coverage.Outcome((0.0, 1.0), (0.5, 0.5))
    assert coverage.coverage(coin, 2, lambda values: values.mean() == 0.5) == pytest.approx(0.5)
    three = coverage.Outcome((0.0, 0.5, 1.0), (0.2, 0.3, 0.5))
    assert coverage.coverage(three, 3, lambda values: True) == pytest.approx(1.0)
    assert coverage.coverage(three, 1, lambda values: values[0] == 0.5) == pytest.approx(0.3)
    assert three.mean == pytest.approx(0.65)


def test_all_outcomes_are_enumerated_once():
    found = list(coverage._compositions(4, 3))
    assert len(found) == len(set(found)) == 15
    assert all(sum(row) == 4 and min(row) >= 0 for row in found)


def test_an_interval_that_assumes_independent_cubes_is_detected():
    """An interval that counts three cubes of an episode as three trials covers 75%."""

    def holds(values):
        found = proportion(int(3 * values.sum()), 3 * len(values))
        return found["lower95"] <= 0.9 <= found["upper95"]

    covered = coverage.coverage(coverage.OUTCOMES["all or nothing, 9 of 10"], 100, holds)
    assert covered < 0.8


def test_a_bootstrap_of_five_episodes_is_detected():
    rng = np.random.default_rng(0)
    outcome = coverage.OUTCOMES["all or nothing, 9 of 10"]

    def holds(values):
        draws = rng.choice(values, (500, len(values))).mean(1)
        return bool(np.quantile(draws, 0.025) <= 0.9 <= np.quantile(draws, 0.975))

    assert coverage.coverage(outcome, 5, holds) < 0.6


def test_every_kind_of_dependence_is_a_distribution():
    assert len(coverage.OUTCOMES) >= 8
    for outcome in [*coverage.OUTCOMES.values(), *coverage.TIMES.values()]:
        assert sum(outcome.probabilities) == pytest.approx(1.0)
        assert len(outcome.values) == len(outcome.probabilities)
    assert all(
        o.low <= min(o.values) <= max(o.values) <= o.high for o in coverage.OUTCOMES.values()
    )
    assert coverage.OUTCOMES["independent cubes"].mean == pytest.approx(0.9)


def test_coverage_of_proportions_is_the_minimum_over_true_rates():
    """With one episode the interval of no success ends at 0.975, where coverage is lowest."""
    rows = list(coverage._proportions(quick=True))
    assert [row["episodes"] for row in rows] == [1, 2, 5]
    assert rows[0]["coverage"] == pytest.approx(0.975, abs=1e-6)


def test_coverage_of_medians():
    rows = list(coverage._medians(quick=True))
    assert rows[0]["coverage"] == pytest.approx(1 - 2 / 2**6)
    assert rows[0]["coverage"] == pytest.approx(binom.cdf(5, 6, 0.5) - binom.cdf(0, 6, 0.5))
    assert coverage._median(coverage.TIMES["times, a third never"]) == 2.0
    assert all(row["coverage"] >= 0.945 for row in rows)


def test_every_interval_covers_at_least_its_level(monkeypatch):
    some = dict([*simulated_policies.policies().items()][::3])
    monkeypatch.setattr(simulated_policies, "policies", lambda: some)
    found = coverage.bench_coverage(quick=True)
    assert found["interval_coverage_min"] >= 0.945
    assert found["interval_coverage_least"] in found["interval_coverage"]
    assert {row["interval"] for row in found["interval_coverage"]} == {"mean", "share", "median"}
    assert found["false_certain_rate"] <= 0.05
