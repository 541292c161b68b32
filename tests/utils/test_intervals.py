import numpy as np
import pytest

from drone_rl.utils.intervals import mean_bounds, median_bounds, proportion


def test_clopper_pearson_by_known_values():
    # the rule of three's exact form: no failure in n gives a lower end of (alpha/2)^(1/n)
    result = proportion(1000, 1000)
    assert result["lower95"] == pytest.approx(0.025 ** (1 / 1000))
    assert result["upper95"] == 1.0
    five = proportion(5, 10)
    assert (five["lower95"], five["upper95"]) == pytest.approx((0.1871, 0.8129), abs=1e-4)
    none = proportion(0, 10)
    assert (none["lower95"], none["upper95"]) == pytest.approx((0.0, 0.3085), abs=1e-4)


def test_share_of_nothing_is_unknown():
    result = proportion(0, 0)
    assert result["share"] is None
    assert (result["lower95"], result["upper95"]) == (0.0, 1.0)


def test_mean_bounds_of_nothing_and_of_sure_things():
    assert mean_bounds([]) == {"mean": None, "lower95": 0.0, "upper95": 1.0, "count": 0}
    ones = mean_bounds(np.ones(400))
    assert ones["upper95"] == 1.0
    assert 0.98 < ones["lower95"] < 0.025 ** (1 / 400)  # can't beat the exact interval
    mirrored = mean_bounds(-np.ones(400), -1.0, 1.0)
    assert mirrored["upper95"] == pytest.approx(-(2 * ones["lower95"] - 1))


def test_mean_bounds_contain_the_exact_interval_of_a_share():
    values = np.repeat([1.0, 0.0], [360, 40])
    bounds, exact = mean_bounds(values), proportion(360, 400)
    assert bounds["lower95"] < exact["lower95"] < 0.9 < exact["upper95"] < bounds["upper95"]
    assert bounds["upper95"] - bounds["lower95"] < 2 * (exact["upper95"] - exact["lower95"])
    assert mean_bounds(values[::-1]) == bounds


def test_mean_bounds_refuse_values_out_of_range():
    with pytest.raises(ValueError, match="from 0"):
        mean_bounds([0.5, 1.5])


def test_mean_bounds_cover_a_rare_disaster():
    rng = np.random.default_rng(0)
    draws = np.where(rng.random((400, 12)) < 0.97, 1.0, 0.0)  # a bootstrap covers 31% here
    found = [mean_bounds(row) for row in draws]
    assert np.mean([f["lower95"] <= 0.97 <= f["upper95"] for f in found]) >= 0.95


def test_median_bounds_are_order_statistics():
    assert median_bounds(range(5)) is None  # 1 - 2 / 2**5 = 0.94
    assert median_bounds([5, 1, 2, 3, 4, np.inf]) == (1.0, np.inf)  # 1 - 2 / 2**6 = 0.97
    assert median_bounds(range(10)) == (1.0, 8.0)  # 1 - 2 * 11 / 2**10 = 0.98
