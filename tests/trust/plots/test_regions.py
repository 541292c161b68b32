"""Two regions, and one where nothing is seen."""

import numpy as np
import pytest
from matplotlib.patches import PathPatch

from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.trust.plots.regions import chart

NUMBERS = {
    "window": {"nearest": 2.0, "farthest": 4.0, "sideways": 3.0},
    "touch_distance": 1.5,
    "least_gap_ahead": 3.0,
    "least_gap_left": 2.0,
    "unseen": 0.1,
}
WAYS = {
    "points": np.array(
        [
            *((2, -3), (4, -3), (4, 1), (2, 1)),  # forward, mostly to the right
            *((2, 1), (4, 1), (4, 3), (2, 3)),  # left
            *((2, 2.5), (2.00014, 2.5), (2, 3)),  # not seen
        ],
        float,
    ),
    "ends": np.array([4, 8, 11]),
    "labels": np.array([0, 1, 3]),
}  # fmt: skip


def test_chart_of_regions():
    figure = chart(NUMBERS, WAYS, SHOWN_MOVES)
    (axis,) = figure.axes
    assert axis.get_xlim() == (3, -3)
    forward, left, unseen = (p for p in axis.patches if isinstance(p, PathPatch))
    assert forward.get_path().get_extents().bounds == (-3, 2, 4, 2)
    assert left.get_path().get_extents().bounds == (1, 2, 2, 2)
    assert forward.get_facecolor()[:3] == pytest.approx(np.array(SHOWN_MOVES.colors[0]) / 255)
    assert unseen.get_hatch()
    texts = [text.get_text() for text in axis.get_legend().get_texts()]
    assert texts[:4] == ["goes left", "goes forward", "goes right", "cube not seen"]
    near = NUMBERS["window"]["nearest"]
    assert [text.get_text() for text in axis.texts] == [f"not covered: closer than {near:g} m"]
