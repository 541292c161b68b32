from drone_rl.explanations.report.places import PART
from tests.evidence import EXPLANATION
from tests.trust.plots.test_regions import NUMBERS, WAYS


def test_a_map_is_drawn_told_and_can_be_zoomed(make_explanation):
    numbers = {"places": EXPLANATION["places"] | NUMBERS}
    explanation = make_explanation(numbers, {f"places_{name}": a for name, a in WAYS.items()})
    assert PART.fits(explanation)
    assert list(PART.draw(explanation)) == ["places"]
    head, *rows = PART.tables(explanation)["places"]
    assert head[:3] == ["one cube", "share of places", "forward"]
    assert [row[0] for row in rows] == ["on its left", "straight ahead", "on its right", "anywhere"]
    shown = PART.extras(explanation)
    assert shown["svg"].startswith("<svg ") and "xmlns" not in shown["svg"]
    assert shown["rows"] == [head, *rows]


def test_without_a_map_nothing_is_drawn(make_explanation):
    explanation = make_explanation({"places": {"refused": "it sees a stack of frames"}})
    assert PART.fits(explanation)
    assert PART.draw(explanation) == {} and PART.tables(explanation) == {}
    assert PART.extras(explanation) == {"svg": ""}
