import numpy as np
import pytest

from drone_rl.explanations.report.truth import changes
from drone_rl.trust.plots.images import enlarge, titled


@pytest.fixture
def explanation(make_explanation):
    effects = {
        "target taken away": {"mean": 0.5, "lower95": 0.4, "upper95": 0.6},
        "target moved": {"mean": None, "lower95": None, "upper95": None},
    }
    truth = {"shown_frame": 3, "interventions": effects}
    after = np.zeros((2, 4, 60, 3), np.uint8)
    explanation = make_explanation({"truth": truth}, {"interventions": after})
    explanation.data["frames"] = np.full((12, 4, 60, 3), 200, np.uint8)
    return explanation


@pytest.mark.parametrize(
    ("place", "gray", "caption"),
    [
        (0, 200, "as it was"),
        (1, 0, "target taken away: 0.50 [0.40, 0.60]"),
        (2, 0, "target moved: not tried"),
    ],
)
def test_each_change_stands_under_what_it_does(explanation, place, gray, caption):
    tile = titled(enlarge(np.full((4, 60, 3), gray, np.uint8)), caption)
    shown = changes(explanation)
    assert [*shown][place] == caption
    assert list(shown[caption].getdata()) == list(tile.getdata())
