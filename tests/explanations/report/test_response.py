import numpy as np
import pytest

from drone_rl.explanations.report.response import response_chart, response_tables


@pytest.fixture
def explanation(make_explanation):
    probabilities = np.zeros((2, 3, 4, 3))
    probabilities[..., 0] = 1.0
    probabilities[1, 2, 3] = [0.25, 0.5, 0.25]
    blind = np.zeros((2, 3, 4), bool)
    blind[0, 0, 0] = True
    collected = np.zeros((2, 2, 2), bool)
    collected[1, 0, 1] = True
    arrays = {
        "response_height": np.array([0.0, 1.5]),
        "response_forward": np.array([2.0, 4.0, 6.0]),
        "response_lateral": np.array([-3.0, -1.0, 1.0, 3.0]),
        "response_probabilities": probabilities,
        "response_oracle": np.array([2, 0, 0, 1]),
        "response_blind": blind,
        "outcome_height": np.array([0.0, 1.5]),
        "outcome_forward": np.array([2.0, 6.0]),
        "outcome_lateral": np.array([-3.0, 3.0]),
        "outcome_collected": collected,
    }
    return make_explanation(arrays=arrays)


def test_each_place_has_a_row_with_what_it_does_and_what_comes_of_it(explanation):
    found = response_tables(explanation)
    heading, *rows = found["response"]
    assert heading[-5:] == ["p_forward", "p_left", "p_right", "needed", "blind"]
    assert len(rows) == 2 * 3 * 4
    assert rows[0] == [0.0, 2.0, -3.0, 1.0, 0.0, 0.0, "right", 1]
    assert rows[-1] == [1.5, 6.0, 3.0, 0.25, 0.5, 0.25, "left", 0]
    assert found["outcomes"][1:] == [
        [z, f, x, int((z, f, x) == (1.5, 2.0, 3.0))]
        for z in (0.0, 1.5) for f in (2.0, 6.0) for x in (-3.0, 3.0)
    ]  # fmt: skip


def test_maps_of_each_height_the_highest_on_top(explanation):
    axes = response_chart(explanation).axes[:10]
    titles = [axis.get_title().split("\n")[0] for axis in axes[:5]]
    assert titles == [
        "P(left)", "P(forward)", "P(right)", "most probable action", "outcome"
    ]  # fmt: skip
    assert axes[0].get_ylabel().endswith("cube +1.5 m")
    assert axes[5].get_ylabel().endswith("cube +0 m")
    left = axes[0].images[0].get_array()
    assert left[2, 3] == 0.5 and left.sum() == 0.5


def test_the_size_of_the_chart_its_key_and_what_is_needed(explanation, make_explanation):
    figure = response_chart(explanation)
    assert figure.get_size_inches().tolist() == [3.2 * 5, 3.9 * 2]
    assert len(figure.axes) == 10 + 1  # and the bar of colours
    keys = {i: a.get_legend() for i, a in enumerate(figure.axes[:10]) if a.get_legend()}
    assert list(keys) == [8, 9]  # below the last two
    assert [t.get_text() for t in keys[8].get_texts()] == ["forward", "left", "right"]
    _, *rows = response_tables(explanation)["response"]
    assert [row[-2] for row in rows[:4]] == ["right", "forward", "forward", "left"]
    arrays = dict(explanation.arrays)
    arrays["response_oracle"] = np.array([-1, 0, 0, 1])
    _, first, *_ = response_tables(make_explanation(arrays=arrays))["response"]
    assert first[-2] == ""


def test_of_one_height_alone_it_is_not_said(explanation, make_explanation):
    arrays = {
        name: values[:1] if values.ndim > 1 or name.endswith("height") else values
        for name, values in explanation.arrays.items()
    }
    axes = response_chart(make_explanation(arrays=arrays)).axes
    assert axes[0].get_ylabel() == "metres ahead"
    assert all(axis.get_xlabel() == "metres to the left (+) or right (-)" for axis in axes[:5])
