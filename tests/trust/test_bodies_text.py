"""Policies in several bodies, in words and as rows of a table."""

import pytest

from drone_rl.trust.bodies import cell, failure, rows
from tests.evidence import VERDICT, changed

GOOD = changed(
    VERDICT,
    {
        "kind": "good",
        "certain": True,
        "greedy.success": {"share": 0.975, "lower95": 0.954, "upper95": 0.988},
        "failures.largest": None,
    },
)
BAD = changed(
    VERDICT,
    {
        "kind": "poor",
        "certain": False,
        "greedy.success": {"share": 0.1, "lower95": 0.07, "upper95": 0.14},
        "failures.largest": {"by": "end", "value": "step_limit", "failed": 9, "lower95": 0.1},
    },
)
NUMBERS = {
    "bodies": ["computer vision", "wind 8 m/s"],
    "policies": {"one": {"computer vision": GOOD, "wind 8 m/s": BAD}},
}


@pytest.mark.parametrize(
    ("verdict", "words"), [(GOOD, "good 97.5% (95.4 to 98.8)"), (BAD, "poor? 10.0% (7.0 to 14.0)")]
)
def test_a_cell_has_kind_share_and_interval(verdict, words):
    assert cell(verdict) == words


def test_a_row_a_policy_a_column_a_body():
    assert rows(NUMBERS) == [
        ["", "computer vision", "wind 8 m/s"],
        ["one", "good 97.5% (95.4 to 98.8)", "poor? 10.0% (7.0 to 14.0)"],
    ]


def test_where_it_fails_most():
    assert failure(GOOD) == ""
    assert failure(BAD) == "by ending at the step limit"
    aside = changed(BAD, {"failures.largest": {"by": "side", "value": "left"}})
    assert failure(aside) == "with cubes on its left"
