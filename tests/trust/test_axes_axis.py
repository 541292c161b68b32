import math

import pytest

import drone_rl
from drone_rl.trust.axes import AXES, FACTORS, INVERSE, LINEAR, Axis
from drone_rl.trust.perturbations import Condition


def axis(scale=LINEAR, neutral=0.0, **kwargs):
    strengths = (1.0, 2.0, 3.0, 4.0, 5.0)
    return Axis("a", "b", "m", neutral, strengths, lambda s, _: Condition(), scale=scale, **kwargs)


def test_half_as_much_is_as_far_as_twice_as_much():
    of_factors = axis(FACTORS, 1.0)
    assert of_factors.position(2.0) == -of_factors.position(0.5) == pytest.approx(math.log(2))
    assert of_factors.between(1.0, 0.25) == pytest.approx(0.5)
    assert of_factors.position(1.0) == 0


def test_infinitely_much_may_be_none():
    of_visibility = axis(INVERSE, math.inf)
    assert of_visibility.position(50.0) == pytest.approx(0.02)
    assert of_visibility.between(math.inf, 50.0) == pytest.approx(100.0)
    assert INVERSE.back(0.0) == math.inf


def test_between_whole_numbers_there_may_be_none():
    steps = axis(whole=True)
    assert [steps.between(4.0, 8.0, share) for share in (0.0, 0.5, 0.9999)] == [5.0, 6.0, 7.0]
    assert [steps.between(8.0, 4.0, share) for share in (0.0, 0.9999)] == [7.0, 5.0]
    assert steps.between(1.0, 2.0) is None
    assert axis().between(1.0, 2.0) == 1.5
    assert axis().between(2.0, 1.0, 0.25) == 1.75


def test_a_position_is_that_of_one_strength():
    for one in (axis(), axis(FACTORS, 1.0), axis(INVERSE, math.inf)):
        assert one.at(one.position(4.0)) == pytest.approx(4.0)
        assert one.at(0.0) == pytest.approx(one.neutral)


@pytest.mark.parametrize("name", list(AXES))
def test_a_value_leads_back_to_its_strength(name):
    of, one = drone_rl.load_policy("good").description, AXES[name]
    for strength in one.strengths:
        assert one.strength(one.value(strength, of), of) == pytest.approx(strength)
    assert one.strength(math.inf, of) == math.inf


def test_less_is_more_on_an_inverse_scale():
    assert axis(INVERSE, math.inf).signs == {"low": 1, "high": -1}
    assert axis().signs == axis(FACTORS, 1.0).signs == {"low": -1, "high": 1}
