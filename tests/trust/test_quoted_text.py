"""What a verdict, a card or a report quotes of a robustness evaluation."""

import pytest

from drone_rl.trust.shifts_text import QUOTED, is_quoted, not_evaluated, why_not
from drone_rl.utils.text import said
from tests.evidence import SHIFTS, VERDICT, changed

GOOD = {"verdict": {**VERDICT, "kind": "good", "certain": True}, "shifts": SHIFTS}


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"shifts": {"refused": "it is of another task"}}, "of another task"),
        ({"verdict.good_share": 0.99}, "requires 0.9 of the oracle's success rate"),
        ({"verdict.kind": "poor"}, "this verdict does not"),
    ],
)
def test_refused_evaluations_are_not_quoted(changes, why):
    evidence = changed(GOOD, changes)
    assert not is_quoted(evidence) and why in why_not(evidence)
    assert list(said(QUOTED, evidence)) == ["domain.refused"]
    assert not_evaluated(evidence) == ["colors", "light", "sizes"]


def test_evaluations_that_do_not_contradict_the_verdict_are_quoted():
    assert is_quoted(changed(GOOD, {"verdict.kind": "poor", "verdict.certain": False}))
    nowhere = {"shifts.domain.plain.good": False, "verdict.kind": "poor"}
    assert is_quoted(changed(GOOD, nowhere))


def test_groups_that_were_not_evaluated():
    assert not_evaluated(GOOD) == ["colors", "sizes"]
    assert not_evaluated({"verdict": VERDICT}) == ["colors", "light", "sizes"]
