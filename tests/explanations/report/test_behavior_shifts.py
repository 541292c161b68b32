import numpy as np

from drone_rl.explanations.report.behavior import SHIFTS_PART
from drone_rl.trust.shifts_text import NAMES
from tests.evidence import SHIFTS, VERDICT

GOOD = {**VERDICT, "kind": "good", "certain": True}
ARRAYS = {f"shifts_{name}": np.zeros((6, 5, 16, 3), np.uint8) for name in SHIFTS["axes"]}


def test_curves_strips_and_a_table(make_explanation):
    explanation = make_explanation({"shifts": SHIFTS, "verdict": GOOD}, ARRAYS)
    assert SHIFTS_PART.fits(explanation)
    drawn = SHIFTS_PART.draw(explanation)
    assert [*drawn] == ["shifts", *(f"conditions_{name}" for name in SHIFTS["axes"])]
    assert len(drawn["shifts"]) == 3 + 1 and len(drawn["conditions_sun"]) == 3
    head, *rows = SHIFTS_PART.tables(explanation)["shifts"]
    assert head[0] == "success, constant" and len(rows) == 3
    assert SHIFTS_PART.extras(explanation) == {"rows": [head, *rows], "names": NAMES}


def test_nothing_is_shown_of_what_is_not_believed(make_explanation):
    for numbers in (
        {"shifts": {"refused": "it is of another task"}, "verdict": GOOD},
        {"shifts": SHIFTS, "verdict": {**GOOD, "kind": "poor"}},
    ):
        explanation = make_explanation(numbers)
        assert SHIFTS_PART.fits(explanation)
        assert SHIFTS_PART.draw(explanation) == {}
        assert SHIFTS_PART.extras(explanation)["rows"] == []


def test_without_such_flights_there_is_no_part(make_explanation):
    assert not SHIFTS_PART.fits(make_explanation({"verdict": GOOD}))
