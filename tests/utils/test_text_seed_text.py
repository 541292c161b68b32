import pytest

from drone_rl.trust.evaluate import EVALUATION
from drone_rl.utils.text import CHANCES, CHECK, is_fixed, said, seed_line, seed_of


@pytest.mark.parametrize(
    ("evidence", "seed", "fixed"),
    [
        ({"seed": 5, "seed_is_fixed": True}, 5, True),
        ({"seed": 5, "seed_is_fixed": False}, 5, False),
        ({"settings": {"seed": 4}}, 4, True),  # of version 0.1
        ({"seed": 3}, 3, True),  # of version 0.1
        ({}, None, True),
        ({"settings": "odd"}, None, True),
    ],
)
def test_results_of_version_0_1_count_as_fixed(evidence, seed, fixed):
    assert (seed_of(evidence), is_fixed(evidence)) == (seed, fixed)


def test_the_warning_names_the_seed_and_what_it_was_used_for():
    fixed = {"seed": 0, "seed_is_fixed": True}
    assert said((*EVALUATION, *CHECK), fixed) == {
        "evaluation.fixed_seed": (
            "Fixed seed 0: a policy could have been fitted to these environments."
        ),
        "check.fixed_seed": "Fixed seed 0: a policy could have been fitted to these placements.",
    }
    unknown = {"seed": None, "seed_is_fixed": True}
    assert said(CHANCES, unknown)["chances.fixed_seed"].startswith("Fixed placements: ")
    assert said((*EVALUATION, *CHECK, *CHANCES), {"seed": 9, "seed_is_fixed": False}) == {}


def test_the_line_says_whether_the_seed_is_fresh():
    fresh = {"seed": 193287468211, "seed_is_fixed": False}
    assert seed_line(fresh) == "environments: seed 193287468211 (fresh)"
    assert seed_line({"seed": 0}, "placements") == "placements: seed 0 (fixed)"
    assert seed_line({}) == "environments: seed not recorded (fixed)"
