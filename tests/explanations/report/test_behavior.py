from drone_rl.explanations.report.behavior import FLAWS_PART, MAX_PAIRS, pairs
from drone_rl.trust.plots.images import frame_with_probabilities


def listed(*kinds):
    return {"contradictions": {"list": [{"kind": k, "left": 1, "right": 2} for k in kinds]}}


def test_kinds_without_a_pair_are_not_drawn(make_explanation):
    assert FLAWS_PART.draw(make_explanation(listed())) == {}
    found = FLAWS_PART.draw(make_explanation(listed("justified", "contradiction")))
    assert found.keys() == {"pairs_justified", "pairs_contradiction"}


def test_the_first_few_pairs_are_shown_left_beside_right(make_explanation):
    explanation = make_explanation(listed(*["unknown"] * (MAX_PAIRS + 3)))
    shown = pairs(explanation, "unknown")
    assert len(shown) == 2 * MAX_PAIRS
    assert [*shown][:2] == ["pair 1, frame 1: more left", "pair 1, frame 2: more right"]
    tile = frame_with_probabilities(explanation.data, 1, "frame 1: more left")
    assert list(shown["pair 1, frame 1: more left"].getdata()) == list(tile.getdata())
