import pytest

from drone_rl.utils.intervals import Share
from drone_rl.utils.models import Seeded
from drone_rl.utils.text import at_most, listed, ordinal, percent, plural, rate


def test_lists_and_counts():
    assert [listed(["a", "b", "c"][:n], "or") for n in range(4)] == ["", "a", "a or b", "a, b or c"]
    assert [plural(n, "pair") for n in range(3)] == ["0 pairs", "1 pair", "2 pairs"]
    assert plural(2, "axis", "axes") == "2 axes"
    assert [ordinal(i) for i in (0, 8, 9, 10)] == ["first", "ninth", "10th", "11th"]
    assert [ordinal(i) for i in (20, 21, 22, 110)] == ["21st", "22nd", "23rd", "111th"]


def test_percentages_are_never_rounded_to_none_or_all():
    shares = (0, 0.0004, 0.0123, 0.9749, 0.9996, 1.0)
    assert [percent(share) for share in shares] == [
        "0%", "<0.1%", "1.2%", "97.5%", ">99.9%", "100%"
    ]  # fmt: skip
    assert percent(-0.2) == "-20.0%" and percent(0.0031, 2) == "0.31%"


def test_upper_bounds_are_rounded_up():
    shares = (0, 0.0004, 0.00918, 0.45, 0.9996, 1.0)
    assert [at_most(share) for share in shares] == ["0%", "0.1%", "1.0%", "45.0%", "100%", "100%"]
    assert at_most(0.00918, 2) == "0.92%"


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
    assert rate(Share(share=share, lower95=lower, upper95=upper, successes=0, trials=0)) == text


def test_seeds_are_reported():
    assert Seeded(seed=9, seed_is_fixed=False).seed_line() == "environments: seed 9 (fresh)"
    fixed = Seeded(seed=5)
    assert fixed.seed_line("placements") == "placements: seed 5 (fixed)"
    assert fixed.seed_warning().startswith("Fixed seed 5: a policy could have been fitted")
    assert fixed.replace(seed_is_fixed=False).seed_warning() == ""
