"""The exact map: two regions, and one where nothing is seen."""

import pytest
from matplotlib.patches import PathPatch

from drone_rl.explanations.report.places import chart
from drone_rl.sim.vocabulary import SHOWN_MOVES
from tests.explanations.example import changed_explanation


def test_chart_of_regions():
    figure = chart(changed_explanation().places, SHOWN_MOVES)
    (axis,) = figure.axes
    assert axis.get_xlim() == (3, -3)
    forward, left, unseen = (p for p in axis.patches if isinstance(p, PathPatch))
    assert forward.get_path().get_extents().bounds == (-3, 2, 4, 2)
    assert left.get_path().get_extents().bounds == (1, 2, 2, 2)
    assert forward.get_facecolor()[:3] == pytest.approx([of / 255 for of in SHOWN_MOVES.colors[0]])
    assert unseen.get_hatch()
    texts = [text.get_text() for text in axis.get_legend().get_texts()]
    assert texts[:4] == ["goes left", "goes forward", "goes right", "cube not seen"]
    assert [text.get_text() for text in axis.texts] == ["not covered: closer than 2 m"]
