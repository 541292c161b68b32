"""Hand-computed means and bands."""

import numpy as np

from drone_rl.sweeps.statistics import bootstrap_band, interquartile_mean, on_grid


def test_interquartile_mean_by_hand():
    assert interquartile_mean(np.array([-100.0, 1.0, 3.0, 999.0])) == 2.0
    # of five values, the middle three count 3/4, 1, 3/4: (0.75 * 2 + 4 + 0.75 * 9) / 2.5
    np.testing.assert_allclose(interquartile_mean(np.array([0, 2, 4, 9, 50.0])), 4.9)
    assert interquartile_mean(np.array([7.0])) == 7.0
    np.testing.assert_array_equal(interquartile_mean(np.ones((4, 3))), np.ones(3))


def test_band_holds_the_mean_repeats_and_has_no_width_without_spread():
    values = np.random.default_rng(1).normal(size=(10, 3))
    lower, upper = bootstrap_band(values)
    mean = interquartile_mean(values)
    assert ((lower < mean) & (mean < upper)).all()
    np.testing.assert_array_equal(bootstrap_band(values)[0], lower)
    same = bootstrap_band(np.ones((5, 2)))
    np.testing.assert_array_equal(same[0], same[1])


def test_band_covers_the_truth_about_as_often_as_it_says():
    random = np.random.default_rng(0)
    hits = 0
    for trial in range(200):
        lower, upper = bootstrap_band(random.normal(size=(20, 1)), resamples=200, seed=trial)
        hits += bool(lower[0] <= 0 <= upper[0])
    assert 0.85 <= hits / 200 <= 1.0


def test_a_curve_starts_at_zero_and_stays_where_it_ended():
    x, y = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    np.testing.assert_array_equal(on_grid(x, y, np.array([0, 10, 15, 99.0])), [0, 1, 1.5, 2])
    np.testing.assert_array_equal(on_grid(x[:0], y[:0], np.zeros(2)), [0, 0])
