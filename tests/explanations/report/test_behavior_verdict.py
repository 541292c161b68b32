import pytest

from drone_rl.explanations.report.behavior import EVALUATION_PART


@pytest.mark.parametrize(
    ("truth", "name"),
    [
        ({"trusted": "grad_cam"}, "Grad-CAM"),
        ({"trusted": None}, "none"),
        (None, "none was tested"),
    ],
)
def test_the_map_to_trust_is_named_as_people_call_it(make_explanation, truth, name):
    numbers = {"seed": 5, "seed_is_fixed": False} | ({} if truth is None else {"truth": truth})
    assert EVALUATION_PART.extras(make_explanation(numbers)) == {
        "trusted": name,
        "seed": "environments: seed 5 (fresh)",
    }
