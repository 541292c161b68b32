"""Coverage of intervals by enumeration, and rates of certain but wrong verdicts."""

import numpy as np
import pytest

from benchmarks import coverage, simulated_policies
from benchmarks.exact_coverage import Truth
from benchmarks.simulated_policies import (
    A,
    L,
    SimulatedPolicy,
    judge_samples,
    policies,
)
from drone_rl.trust.rule import Rule, VerdictKind
from drone_rl.utils.intervals import Share, proportion


def test_coverage_is_exact():
    """Two tosses of a fair coin: the mean is a half with probability 0.5."""
    coin = coverage.Outcome((0.0, 1.0), (0.5, 0.5))
    assert coverage.coverage(coin, 2, lambda values: values.mean() == 0.5) == pytest.approx(0.5)
    three = coverage.Outcome((0.0, 0.5, 1.0), (0.2, 0.3, 0.5))
    assert coverage.coverage(three, 3, lambda values: True) == pytest.approx(1.0)
    assert coverage.coverage(three, 1, lambda values: values[0] == 0.5) == pytest.approx(0.3)
    assert three.mean == pytest.approx(0.65)


def test_an_interval_that_assumes_independent_cubes_is_detected():
    """An interval that counts three cubes of an episode as three trials covers 75%."""

    def holds(values):
        interval = proportion(int(3 * values.sum()), 3 * len(values))
        return interval.lower95 <= 0.9 <= interval.upper95

    assert coverage.coverage(coverage.OUTCOMES["all or nothing, 9 of 10"], 100, holds) < 0.8


def test_quantities_of_an_episode_type():
    policy = SimulatedPolicy({((L, A), (1, 0), False): 1.0}, forward_share=0.3)
    values = (float(value[0]) for value in policy.observed)
    observed = dict(zip(Rule().quantities, values, strict=True))
    assert observed["success"] == pytest.approx(-0.9)
    assert (observed["collected left"], observed["collected ahead"]) == (1.0, 0.0)
    assert np.isnan(observed["collected right"])
    assert observed["above random"] == pytest.approx(0.5 - 1 / 6)
    assert observed["above forward"] == pytest.approx(0.5 - 1 / 6 - 5 / 6 * 0.3)


def test_intervals_that_are_too_narrow_are_detected(monkeypatch):
    """At a true rate of 0.9, a rule that trusts the mean is often certain and wrong."""
    exact = simulated_policies.estimate

    def narrow(*args):
        quantity = exact(*args)
        middle = quantity.lower if quantity.value is None else quantity.value
        return quantity.replace(lower=middle - 0.001, upper=middle + 0.001)

    policy = policies()["all or nothing, success +0.00"]
    counts = np.random.default_rng(0).multinomial(400, policy.shares, 100)
    assert judge_samples(policy, counts).count(VerdictKind.GOOD) == 0
    monkeypatch.setattr(simulated_policies, "estimate", narrow)
    assert judge_samples(policy, counts).count(VerdictKind.GOOD) > 20


@pytest.mark.parametrize(
    ("success", "undecided", "is_covered"),
    [
        (0.6, 0.0, True),  # intervals are closed
        (0.61, 0.0, False),
        (0.39, 0.0, False),
        (0.39, 0.02, True),  # undecided placements can move the rate into the interval
        (0.3, 0.05, False),
    ],
)
def test_an_interval_covers_every_possible_rate(success, undecided, is_covered):
    interval = Share(share=0.5, lower95=0.4, upper95=0.6, successes=1, trials=2)
    assert Truth(success, undecided).is_covered(interval) == is_covered
