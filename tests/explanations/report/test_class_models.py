import numpy as np
import pytest

from drone_rl.explanations.report.class_models import PART, grid, say_class_models
from tests.evidence import EXPLANATION, changed


@pytest.fixture
def explanation(make_explanation):
    reached = {"probabilities": [0.9, 0.8, 0.7]}
    numbers = {
        "class_model": {
            "statistics": {"low": 0.0, "high": 1.0},
            "channels": "gray",
            "probability": reached,
            "logit": reached,
        }
    }
    shown = np.zeros((3, 1, 4, 30))
    shown[1] = 1.0  # the picture for left is white
    arrays = {f"class_model_{objective}": shown for objective in ("probability", "logit")}
    return make_explanation(numbers, arrays)


def test_actions_stand_from_left_to_right_and_objectives_below_each_other(explanation):
    picture = grid([explanation])
    width, height = 30 * 5, 4 * 5 + 22
    assert picture.size == (3 * width + 24, 2 * height + 12)
    middles = [picture.getpixel((x * (width + 12) + 75, 30)) for x in range(3)]
    assert middles == [(255,) * 3, (0,) * 3, (0,) * 3]


def test_colors_are_shown_as_such(explanation):
    for name in ("class_model_probability", "class_model_logit"):
        explanation.arrays[name] = np.zeros((3, 3, 4, 30))
        explanation.arrays[name][1, 0] = 1.0  # the picture for left is red
    explanation.numbers["class_model"]["channels"] = "rgb"
    assert grid([explanation]).getpixel((75, 30)) == (255, 0, 0)


def test_policies_stand_below_each_other(explanation):
    one, two = grid([explanation]), PART.compare([explanation, explanation])["class_models"]
    assert two.size == (one.width, 2 * one.height + 12)


def speak(**changes):
    evidence = changed(EXPLANATION, {k.replace("__", "."): v for k, v in changes.items()})
    return say_class_models(evidence)


def test_a_search_that_found_nothing_proves_nothing():
    assert speak()["class_model.not_reached"] == (
        "None of the 96 attempts made left more probable than not; this does not show that no "
        "observation does."
    )


def test_a_picture_of_either_objective_is_one():
    found = speak(class_model__probability__highest=[0.9, 0.51, 0.9])
    assert "class_model.not_reached" not in found
