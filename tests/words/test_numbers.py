from drone_rl.words.licence import percent
from drone_rl.words.numbers import among, bounds, listed, ordinal, plural


def test_numbers_as_people_write_them():
    found = {"lower95": 0.1, "upper95": 0.256, "successes": 3, "trials": 30}
    assert bounds(found) == "95%: 0.10 to 0.26"
    assert bounds(found, percent) == "95%: 10% to 26%"
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


def test_ordinals_go_on_beyond_their_names():
    assert [ordinal(i) for i in (0, 8, 9, 10)] == ["first", "ninth", "10th", "11th"]
