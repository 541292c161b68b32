"""Shares and means out of files, by hand."""

import copy

import pytest

from drone_rl.utils.consistency import check_intervals, check_mean, check_proportion, check_same
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds, proportion


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (0, 5), (3, 5), (5, 5), (195, 200)])
def test_a_share_that_follows_from_its_counts_is_accepted(successes, trials):
    assert check_proportion(proportion(successes, trials), "it", trials) == successes
    check_proportion(proportion(successes, trials, 0.999), "it")  # wider than 95%


@pytest.mark.parametrize(
    "lie",
    [
        {"share": 7},
        {"share": 0.7},
        {"share": None},
        {"share": "0.6"},
        {"share": float("nan")},
        {"successes": 6},
        {"successes": -3},
        {"successes": 3.0},
        {"trials": 10},
        {"trials": 10**12},
        {"lower95": 0.5},  # 3 of 5: 0.147 to 0.947
        {"upper95": 0.7},
        {"lower95": None},
        {"lower95": float("-inf")},
    ],
)
def test_a_share_that_contradicts_itself_is_refused(lie):
    with pytest.raises(InputError):
        check_proportion({**proportion(3, 5), **lie}, "it", 5)


@pytest.mark.parametrize("values", [[], [0.5], [0.0, 1.0], [1.0] * 200, [0.2, 0.4] * 50])
def test_a_mean_with_its_own_interval_is_accepted(values):
    check_mean(mean_bounds(values), "it", count=len(values))
    check_mean(mean_bounds(values, -1.0, 1.0), "it", (-1.0, 1.0))


@pytest.mark.parametrize(
    "lie",
    [
        {"mean": 1e308},
        {"mean": None},
        {"mean": -0.1},
        {"count": -5},
        {"count": 0},
        {"count": 4},  # of four values an interval is wider
        {"lower95": 0.6},
        {"lower95": 0.49, "upper95": 0.51},
    ],
)
def test_a_mean_that_its_count_does_not_allow_is_refused(lie):
    with pytest.raises(InputError):
        check_mean({**mean_bounds([0.0, 1.0] * 20), **lie}, "it", count=lie.get("count", 40))


def test_the_narrowest_interval_is_that_of_equal_values():
    alike = mean_bounds([0.5] * 40)
    check_mean({**mean_bounds([0.0, 1.0] * 20), **alike}, "it")
    narrower = {**alike, "lower95": alike["lower95"] + 1e-4}
    with pytest.raises(InputError, match="narrower"):
        check_mean(narrower, "it")


def test_rounding_is_no_contradiction():
    check_same(0.1 + 0.2, 0.3, "it")
    with pytest.raises(InputError, match="contradicts"):
        check_same(0.301, 0.3, "it")


NUMBERS = {
    "loops": {"episodes": proportion(3, 30), "loops": 4},
    "list": [{"deep": [{"mean": 0.5, "lower95": 0.4, "upper95": 0.6}]}],
    "dataset": {"frames": 600, "episodes": 30},
}


def test_whatever_is_deep_in_a_file_is_checked():
    check_intervals(NUMBERS, "file")
    lies = copy.deepcopy([NUMBERS] * 4)
    lies[0]["loops"]["episodes"]["share"] = 0.2
    lies[1]["list"][0]["deep"][0]["mean"] = 0.7
    lies[2]["dataset"]["episodes"] = -5
    lies[3]["list"][0]["deep"][0]["upper95"] = None
    for lie in lies:
        with pytest.raises(InputError):
            check_intervals(lie, "file")


def test_depth_is_no_matter():
    nested = {"frames": -1}
    for _ in range(5000):
        nested = {"x": nested}
    with pytest.raises(InputError, match="frames"):
        check_intervals(nested, "file")
