"""Shares, medians and bands of runs by hand."""

import math

import numpy as np
import pytest

from drone_rl.sweeps.summary import median_band, median_of_runs, on_grid, share_of_runs
from drone_rl.utils.intervals import proportion


def test_a_share_of_known_runs_has_the_exact_interval():
    assert share_of_runs(2, 0, 2) == {**proportion(2, 2), "unknown": 0}
    assert share_of_runs(2, 0, 2)["lower95"] == pytest.approx(0.025**0.5)


def test_an_unknown_run_may_be_a_success_or_none():
    found = share_of_runs(3, 2, 10)
    assert found["share"] == 0.3
    assert found["lower95"] == proportion(3, 10)["lower95"]
    assert found["upper95"] == proportion(5, 10)["upper95"]
    assert share_of_runs(0, 4, 4)["upper95"] == 1.0


def test_the_median_has_an_interval_from_six_runs_on():
    assert median_of_runs([5.0, 1.0, 3.0]) == {
        "median": 3.0,
        "more_than": None,
        "lower95": None,
        "upper95": None,
        "runs": 3,
    }
    six = median_of_runs([6.0, 1, 2, 3, 4, 5])  # all six above the median: 2 * 0.5**6 = 3%
    assert (six["median"], six["lower95"], six["upper95"]) == (3.5, 1.0, 6.0)
    assert median_of_runs([])["median"] is None


def test_what_was_never_reached_is_more_than_what_was_had():
    never = math.inf
    late = median_of_runs([10.0, 20.0, 900.0], [10.0, 20.0, 900.0])
    lost = median_of_runs([10.0, 20.0, never], [10.0, 20.0, 900.0])
    assert late["median"] == lost["median"] == 20.0  # the middle one is known in both
    most = median_of_runs([10.0, never, never], [10.0, 30.0, 900.0])
    assert (most["median"], most["more_than"]) == (None, 30.0)


def test_an_interval_with_runs_that_never_got_there_has_no_upper_end():
    had = [10.0, 20, 30, 40, 900, 900]
    found = median_of_runs([10.0, 20, 30, 40, math.inf, math.inf], had)
    assert (found["median"], found["lower95"], found["upper95"]) == (35.0, 10.0, None)
    none = median_of_runs([math.inf] * 6, had)
    assert (none["more_than"], none["lower95"], none["upper95"]) == (35.0, 10.0, None)


def test_a_band_is_the_interval_at_each_place():
    values = np.array([[1.0, 60], [2, 50], [3, 40], [4, 30], [5, 20], [6, 10]])
    lower, upper = median_band(values)
    assert lower.tolist() == [1, 10]
    assert upper.tolist() == [6, 60]
    assert median_band(values[:5]) is None  # five hold the median only 94% of the time


def test_the_band_of_six_covers_the_median_as_often_as_it_says():
    draws = np.random.default_rng(0).exponential(size=(6, 4000))
    lower, upper = median_band(draws)
    covered = (lower <= math.log(2)) & (math.log(2) <= upper)
    assert 0.96 < covered.mean() < 0.978  # 1 - 2 * 0.5**6 = 0.969


def test_a_curve_starts_at_zero_and_stays_where_it_ended():
    x, y = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    np.testing.assert_array_equal(on_grid(x, y, np.array([0, 10, 15, 99.0])), [0, 1, 1.5, 2])
    np.testing.assert_array_equal(on_grid(x[:0], y[:0], np.zeros(2)), [0, 0])
