from drone_rl.utils.text import (
    all_cubes,
    among,
    bounds,
    exact,
    listed,
    ordinal,
    percent,
    plural,
    rate,
)


def test_numbers_as_people_write_them():
    found = {"lower95": 0.1, "upper95": 0.256, "successes": 3, "trials": 30}
    assert bounds(found) == "95%: 0.10 to 0.26"
    assert bounds(found, percent) == "95%: 10.0% to 25.6%"
    assert among(found) == "3 of 30"


def test_lists():
    assert listed([]) == ""
    assert listed(["a"]) == "a"
    assert listed(["a", "b"]) == "a and b"
    assert listed(["a", "b", "c"], "or") == "a, b or c"


def test_counts():
    assert (plural(0, "pair"), plural(1, "pair"), plural(2, "pair")) == (
        "0 pairs", "1 pair", "2 pairs",
    )  # fmt: skip
    assert (plural(1, "axis", "axes"), plural(2, "axis", "axes")) == ("1 axis", "2 axes")


def test_ordinals_go_on_beyond_their_names():
    assert [ordinal(i) for i in (0, 8, 9, 10)] == ["first", "ninth", "10th", "11th"]
    assert [ordinal(i) for i in (20, 21, 22, 23)] == ["21st", "22nd", "23rd", "24th"]
    assert [ordinal(i) for i in (110, 111, 112)] == ["111th", "112th", "113th"]


def test_cubes():
    assert (all_cubes(1), all_cubes(3)) == ("the cube", "all 3 cubes")


def test_nearly_all_is_never_all():
    assert [exact(share) for share in (0.0, 1e-12, 0.25, 1 / 3)] == [
        "0%", "1e-10%", "25%", "33.3333333%",
    ]  # fmt: skip
    assert exact(1 - 1e-9) == "99.9999999%"
    for share in (1 - 1e-10, 1 - 1e-16, 1.0, 1 + 1e-12):  # whose digits, or the sum's, are too few
        assert exact(share) == "more than 99.9999999%"
    assert exact(1 - 1e-16, is_all=True) == "100%"
    assert exact(0.5, is_all=True) == "50%"


def test_percentages_with_one_decimal_are_never_rounded_to_nothing_or_all():
    shares = (0, 0.0004, 0.0123, 0.9749, 0.9996, 1.0)
    assert [percent(share) for share in shares] == [
        "0%", "less than 0.1%", "1.2%", "97.5%", "more than 99.9%", "100%"
    ]  # fmt: skip
    assert [percent(share, 0) for share in shares] == [
        "0%", "less than 1%", "1%", "97%", "more than 99%", "100%"
    ]  # fmt: skip
    figure = {"share": 0.975, "lower95": 0.9543, "upper95": 0.9881}
    assert rate(figure) == "97.5% (95% CI 95.4 to 98.8)"
    assert rate({**figure, "mean": 0.5}, label="") == "97.5% (95.4 to 98.8)"
    assert rate({**figure, "share": None}) == "not offered"
    assert rate({"mean": 0.5, "lower95": 0.0, "upper95": 1.0}) == "50.0% (95% CI 0.0 to 100.0)"


def test_no_rounding_to_certainty():
    all_of_many = {"share": 1.0, "lower95": 0.9996312, "upper95": 1.0}
    assert rate(all_of_many, label="") == "100.0% (>99.9 to 100.0)"
    nearly = {"share": 0.9999, "lower95": 0.99, "upper95": 1.0}
    assert rate(nearly, label="") == ">99.9% (99.0 to 100.0)"
    assert rate({"share": 0.0, "lower95": 0.0, "upper95": 0.0003689}) == "0.0% (95% CI 0.0 to <0.1)"
