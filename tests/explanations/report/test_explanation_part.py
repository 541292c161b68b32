"""Each section has a part, and each part a template."""

from importlib import resources

import pytest

from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.explanations.report.page import PARTS
from drone_rl.utils.text import said
from tests.evidence import EXPLANATION
from tests.explanations.quick import ALL_SECTIONS


def part(**kwargs):
    return Part(**({"title": "Tides", "label": "tides", "needs": ("tides",)} | kwargs))


def test_each_section_of_an_explanation_has_a_part_and_each_part_a_template():
    assert PARTS.keys() - {"left_out"} == ALL_SECTIONS.keys()
    templates = resources.files("drone_rl.explanations.report") / "templates" / "sections"
    assert {f"{name}.html" for name in PARTS} == {t.name for t in templates.iterdir()}


@pytest.mark.parametrize(
    ("numbers", "fits"),
    [
        ({"tides": {}, "moon": 0}, True),
        ({"tides": {}}, False),
        ({"tides": {}, "moon": None}, False),
    ],
)
def test_it_fits_what_holds_all_that_it_needs(numbers, fits):
    assert part(needs=("tides", "moon")).fits(Explanation(numbers, {}, {})) is fits


def test_what_a_part_does_not_make_is_nothing():
    empty = part()
    assert [f(None) for f in (empty.draw, empty.tables, empty.extras, empty.compare)] == [{}] * 4


def test_each_paragraph_has_a_sentence_that_fits_some_explanation():
    for name in PARTS.keys() - {"shifts"}:
        for sentences in PARTS[name].text.values():
            assert said(sentences, EXPLANATION), name
