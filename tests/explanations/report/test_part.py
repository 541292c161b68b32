"""A new part of the page is one module and its template."""

from importlib import resources

import pytest

from drone_rl.explanations.report import sections
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.sections import find_parts
from drone_rl.explanations.sections import find_sections


def part(**kwargs):
    return Part(**({"title": "Tides", "label": "tides", "place": 15, "needs": ("tides",)} | kwargs))


def test_a_module_with_a_part_is_found_at_its_place(tmp_path, monkeypatch):
    (tmp_path / "tides.py").write_text(
        "from drone_rl.explanations.report.part import Part\n"
        "PART = Part(title='Tides', label='tides', place=16, needs=('tides',))\n"
    )
    monkeypatch.setattr(sections, "__path__", [*sections.__path__, str(tmp_path)])
    assert list(find_parts())[:4] == ["evaluation", "shifts", "tides", "dataset"]


def test_each_section_of_an_explanation_has_a_part_and_each_part_a_template():
    assert find_parts().keys() - {"left_out"} == find_sections().keys()
    templates = resources.files("drone_rl.explanations.report") / "templates" / "sections"
    assert {f"{name}.html" for name in find_parts()} == {t.name for t in templates.iterdir()}
    assert len({p.place for p in find_parts().values()}) == len(find_parts())


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
