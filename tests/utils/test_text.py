import pytest

from drone_rl.utils.text import (
    CHECK,
    Sentence,
    exact,
    listed,
    ordinal,
    percent,
    plural,
    rate,
    said,
    say,
    seed_line,
)


def test_lists_and_counts():
    assert [listed(["a", "b", "c"][:n], "or") for n in range(4)] == ["", "a", "a or b", "a, b or c"]
    assert [plural(n, "pair") for n in range(3)] == ["0 pairs", "1 pair", "2 pairs"]
    assert plural(2, "axis", "axes") == "2 axes"
    assert [ordinal(i) for i in (0, 8, 9, 10)] == ["first", "ninth", "10th", "11th"]
    assert [ordinal(i) for i in (20, 21, 22, 110)] == ["21st", "22nd", "23rd", "111th"]


def test_exact_rates_are_never_rounded_to_all():
    shares = (0.0, 1e-12, 0.25, 1 / 3, 1 - 1e-9)
    texts = ["0%", "1e-10%", "25%", "33.3333333%", "99.9999999%"]
    assert [exact(share) for share in shares] == texts
    for share in (1 - 1e-10, 1 - 1e-16, 1.0):  # which too few digits, or a sum's errors, make 1
        assert exact(share) == "more than 99.9999999%"
    assert exact(1 - 1e-16, is_all=True) == "100%"


def test_percentages_are_never_rounded_to_none_or_all():
    shares = (0, 0.0004, 0.0123, 0.9749, 0.9996, 1.0)
    assert [percent(share) for share in shares] == [
        "0%", "<0.1%", "1.2%", "97.5%", ">99.9%", "100%"
    ]  # fmt: skip
    assert percent(-0.2) == "-20.0%" and percent(0.0031, 2) == "0.31%"


@pytest.mark.parametrize(
    ("share", "lower", "upper", "text"),
    [
        (0.975, 0.9543, 0.9881, "97.5% (95% CI 95.4% to 98.8%)"),
        (0.0, 0.0, 0.0003689, "0% (95% CI 0% to <0.1%)"),
        (1.0, 0.9996312, 1.0, "100% (95% CI >99.9% to 100%)"),
        (None, 0.0, 1.0, "not offered"),
    ],
)
def test_rates_with_intervals(share, lower, upper, text):
    assert rate({"share": share, "lower95": lower, "upper95": upper}) == text


MANY = Sentence("loops.many", "a loop", lambda e: e["loops"] > 0, lambda e: f"{e['loops']} loops.")
NONE = Sentence("loops.never", "none", lambda e: e["loops"] == 0, lambda e: "No loop.")


def test_sentences_have_conditions():
    assert say([MANY, NONE], {"loops": 3}) == "3 loops."
    assert said([MANY, NONE], {"loops": 0}) == {"loops.never": "No loop."}
    assert say(lambda e: {"loops.a": "A.", "loops.b": "B."}, {}) == "A. B."


def test_fixed_seeds_are_reported():
    fixed = said(CHECK, {"seed": 5, "seed_is_fixed": True})
    assert [*fixed] == ["check.fixed_seed"]
    assert all("Fixed seed 5" in text for text in fixed.values())
    assert said(CHECK, {"seed": 9, "seed_is_fixed": False}) == {}
    assert seed_line({"seed": 9, "seed_is_fixed": False}) == "environments: seed 9 (fresh)"
    assert seed_line({"seed": 0}, "placements") == "placements: seed 0 (fixed)"
