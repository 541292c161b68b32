import pytest

from drone_rl.utils.intervals import proportion


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
