import numpy as np
import pytest
from hypothesis import settings
from scipy.stats import binom

from drone_rl.utils.intervals import (
    Mean,
    episode_means,
    mean_bounds,
    mean_interval,
    median_bounds,
    proportion,
)

QUICK = settings(max_examples=30, deadline=None)


def test_clopper_pearson_by_known_values():
    # the rule of three's exact form: no failure in n gives a lower end of (alpha/2)^(1/n)
    result = proportion(1000, 1000)
    assert result.lower95 == pytest.approx(0.025 ** (1 / 1000))
    assert result.upper95 == 1.0
    five = proportion(5, 10)
    assert (five.lower95, five.upper95) == pytest.approx((0.1871, 0.8129), abs=1e-4)
    none = proportion(0, 10)
    assert (none.lower95, none.upper95) == pytest.approx((0.0, 0.3085), abs=1e-4)


def test_low_confidence_by_hand():
    """The tail is 0.3 on either side."""
    assert proportion(1, 1, confidence=0.4).lower95 == pytest.approx(0.3)
    assert mean_bounds([1.0], confidence=0.4).lower95 == pytest.approx(1.5 / (2 / 0.3 - 0.5))
    assert median_bounds(range(10), confidence=0.4) == (3.0, 6.0)  # 176 of 1024 are outside


def test_proportion_without_trials():
    result = proportion(0, 0)
    assert result.share is None
    assert (result.lower95, result.upper95) == (0.0, 1.0)


def test_mean_bounds_without_values_and_of_equal_values():
    assert mean_bounds([]) == Mean(mean=None, lower95=0.0, upper95=1.0, count=0)
    ones = mean_bounds(np.ones(400))
    assert ones.upper95 == 1.0
    assert 0.98 < ones.lower95 < 0.025 ** (1 / 400)  # can't beat the exact interval
    mirrored = mean_bounds(-np.ones(400), -1.0, 1.0)
    assert mirrored.upper95 == pytest.approx(-(2 * ones.lower95 - 1))


def test_mean_bounds_contain_the_exact_interval_of_a_share():
    values = np.repeat([1.0, 0.0], [360, 40])
    bounds, exact = mean_bounds(values), proportion(360, 400)
    assert bounds.lower95 < exact.lower95 < 0.9 < exact.upper95 < bounds.upper95
    assert bounds.upper95 - bounds.lower95 < 2 * (exact.upper95 - exact.lower95)
    assert mean_bounds(values[::-1]) == bounds


@pytest.mark.parametrize("wrong", [1.5, float("inf"), -1e-6, 1 + 1e-6])
def test_mean_bounds_refuse_values_out_of_range(wrong):
    with pytest.raises(ValueError, match="from 0"):
        mean_bounds([0.5, wrong])


def test_nan_is_no_value():
    assert mean_bounds([0.5, float("nan"), 0.7]) == mean_bounds([0.5, 0.7])


def test_mean_bounds_cover_a_rare_disaster():
    rng = np.random.default_rng(0)
    draws = np.where(rng.random((400, 12)) < 0.97, 1.0, 0.0)  # a bootstrap covers 31% here
    found = [mean_bounds(row) for row in draws]
    assert np.mean([f.lower95 <= 0.97 <= f.upper95 for f in found]) >= 0.95


def test_median_bounds_are_order_statistics():
    assert median_bounds(range(5)) is None  # 1 - 2 / 2**5 = 0.94
    assert median_bounds([5, 1, 2, 3, 4, np.inf]) == (1.0, np.inf)  # 1 - 2 / 2**6 = 0.97
    assert median_bounds(range(10)) == (1.0, 8.0)  # 1 - 2 * 11 / 2**10 = 0.98


@pytest.mark.parametrize("trials", [1, 6, 15, 40])
def test_coverage_of_proportion_summed_over_all_outcomes(trials):
    intervals = [proportion(k, trials) for k in range(trials + 1)]
    for p in np.linspace(0, 1, 101):
        held = [i.lower95 <= p <= i.upper95 for i in intervals]
        assert binom.pmf(range(trials + 1), trials, p)[held].sum() >= 0.95 - 1e-12


@pytest.mark.parametrize("trials", [1, 4, 13])
def test_coverage_of_mean_bounds_summed_over_all_outcomes(trials):
    rows = [np.repeat([1.0, 0.0], [k, trials - k]) for k in range(trials + 1)]
    found = [mean_bounds(row) for row in rows]
    for p in np.linspace(0.01, 0.99, 99):
        held = [f.lower95 <= p <= f.upper95 for f in found]
        assert binom.pmf(range(trials + 1), trials, p)[held].sum() >= 0.95


def test_mean_bounds_of_one_value_by_hand():
    """Half of the capital is staked wholly, half by half: (1 / m + (1 + 1 / m) / 2) / 2 = 40."""
    one = mean_bounds([1.0])
    assert (one.lower95, one.upper95) == (pytest.approx(1.5 / 79.5), 1.0)
    assert mean_bounds([0.5]).lower95 == pytest.approx(0.5 * 1.5 / 79.5)
    assert mean_bounds([1.0], confidence=0.8).lower95 == pytest.approx(1.5 / 19.5)
    zero = {"mean": 0.0, "lower95": 0.0, "upper95": pytest.approx(1 - 1.5 / 79.5), "count": 1}
    assert dict(mean_bounds([0.0])) == zero


def test_mean_bounds_of_four_values_by_hand():
    """Stakes 1 and 1/2, each with half of the capital: their mean reaches 40 at the lower end."""
    lower = mean_bounds(np.ones(4)).lower95
    assert (lower**-4 + (0.5 + 0.5 / lower) ** 4) / 2 == pytest.approx(40)
    lower = mean_bounds(np.ones(17)).lower95  # beyond 16 values also 1/4 and 1/8
    stakes = [1, 1 / 2, 1 / 4, 1 / 8]
    assert sum((1 - s + s / lower) ** 17 for s in stakes) / 4 == pytest.approx(40)


def test_rounding_errors_at_the_ends_are_in_range():
    assert mean_bounds([1 + 1e-12, -1e-12]).mean == pytest.approx(0.5)


@pytest.mark.parametrize("confidence", [0.9, 0.95])
@pytest.mark.parametrize("count", range(1, 31))
def test_median_bounds_are_the_narrowest_that_cover(count, confidence):
    """The median lies outside ranks r and n + 1 - r with probability 2 P(Binomial(n, 1/2) < r)."""
    found = median_bounds(range(count), confidence)
    ranks = [
        r for r in range(1, count // 2 + 1) if 2 * binom.cdf(r - 1, count, 0.5) <= 1 - confidence
    ]
    assert found == ((max(ranks) - 1, count - max(ranks)) if len(ranks) else None)


def test_each_episode_counts_once():
    # 0.5 of episode 0 and 1 of episode 1, however many frames each has; episode 2 says nothing
    values = np.array([0.0, 1.0, 1.0, np.nan, 1.0, 1.0, np.nan])
    episode = np.array([0, 0, 1, 1, 1, 1, 2])
    assert episode_means(values, episode).tolist() == [0.5, 1.0]
    found = mean_interval(values, episode)
    assert found == mean_bounds([0.5, 1.0])
    assert (found.mean, found.count) == (0.75, 2)


def test_more_frames_of_an_episode_do_not_narrow_the_interval():
    few = mean_interval(np.ones(5), np.arange(5))
    many = mean_interval(np.ones(500), np.arange(500) // 100)
    assert few.lower95 == many.lower95 < 0.6


def test_mean_intervals_have_the_range_of_the_values():
    assert mean_interval(np.array([-0.5]), np.zeros(1), low=-1.0).lower95 < -0.5
    assert mean_interval(np.array([np.nan]), np.zeros(1)).mean is None
    with pytest.raises(ValueError, match="from 0"):
        mean_interval(np.array([-0.5]), np.zeros(1))
