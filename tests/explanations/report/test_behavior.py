from drone_rl.evaluation.plots.images import probed_frame
from drone_rl.explanations.report.behavior import FLAWS_PART, MOST_PAIRS, pairs


def listed(*kinds):
    return {"contradictions": {"list": [{"kind": k, "left": 1, "right": 2} for k in kinds]}}


def test_kinds_without_a_pair_are_not_drawn(make_explanation):
    assert FLAWS_PART.draw(make_explanation(listed())) == {}
    found = FLAWS_PART.draw(make_explanation(listed("justified", "contradiction")))
    assert found.keys() == {"pairs_justified", "pairs_contradiction"}


def test_the_first_few_pairs_are_shown_left_beside_right(make_explanation):
    explanation = make_explanation(listed(*["unknown"] * (MOST_PAIRS + 3)))
    picture = pairs(explanation, "unknown")
    tile = probed_frame(explanation.data, 1, "frame 1: more left")
    assert picture.size == (2 * tile.width + 12, MOST_PAIRS * (tile.height + 12) - 12)
    here = picture.crop((0, 0, *tile.size))
    assert list(here.getdata()) == list(tile.getdata())
