import numpy as np
import pytest

from drone_rl.explanations.report.response import response_charts, response_tables


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


def test_maps_of_each_height_the_highest_first(explanation):
    charts = response_charts(explanation)
    names = ["P(left)", "P(forward)", "P(right)"]
    blind = "most probable action; inside the white line: blind"
    assert [*charts] == [
        *(f"{name}, cube +1.5 m" for name in (*names, "most probable action", "outcome")),
        *(f"{name}, cube +0 m" for name in (*names, blind, "outcome")),
    ]
    left = charts["P(left), cube +1.5 m"].axes[0].images[0].get_array()
    assert left[2, 3] == 0.5 and left.sum() == 0.5


def test_the_size_of_the_charts_their_keys_and_what_is_needed(explanation, make_explanation):
    charts = response_charts(explanation)
    assert {tuple(chart.get_size_inches()) for chart in charts.values()} == {(4.5, 4.4)}
    keys = {name: chart.legends[0] for name, chart in charts.items() if chart.legends}
    assert len(keys) == 4  # the last two of each height
    texts = keys["most probable action, cube +1.5 m"].get_texts()
    assert [t.get_text() for t in texts] == ["forward", "left", "right"]
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
    charts = response_charts(make_explanation(arrays=arrays))
    axes = [chart.axes[0] for chart in charts.values()]
    assert next(iter(charts)) == axes[0].get_title() == "P(left)"
    assert all(axis.get_ylabel() == "metres ahead" for axis in axes)
    assert all(axis.get_xlabel() == "metres to the left (+) or right (-)" for axis in axes)
