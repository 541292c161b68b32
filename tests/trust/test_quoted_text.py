"""What a verdict, a card or a report quotes of a robustness evaluation."""

import pytest

from drone_rl.trust.quoted_text import BRIEF, QUOTED, is_quoted, not_evaluated, why_not
from drone_rl.utils.text import said
from tests.evidence import SHIFTS, VERDICT, changed

GOOD = {"verdict": {**VERDICT, "kind": "good", "certain": True}, "shifts": SHIFTS}


def test_what_is_quoted_says_of_whom_and_by_what():
    text = said(QUOTED, GOOD)
    assert list(text) == ["domain.quoted"]
    assert "the sun at 21.1 to 60 degrees" in text["domain.quoted"]
    quoted = text["domain.quoted"]
    assert quoted.startswith(
        "Read from shifts.json, dated 2026-01-31 12:00, not measured again here: Good with"
    )
    assert quoted.endswith(
        "400 (ranges) and 200 (others) episodes at each strength (seed 0) of 3 axes (elevation of "
        "the sun, blur and brightness)."
    )
    few = said(QUOTED, changed(GOOD, {"shifts.domain": None}))["domain.quoted"]
    assert "task: 200 episodes at each strength" in few and "Good with" not in few


def test_a_verdict_names_the_ranges_in_one_line():
    told = said(BRIEF, changed(GOOD, {"shifts.seed_is_fixed": False}))["domain.brief"]
    assert told.startswith("Read from shifts.json, dated 2026-01-31 12:00, not measured again")
    assert "good with the sun at 21.1 to 60 degrees" in told and len(told) < 300
    few = said(BRIEF, changed(GOOD, {"shifts.domain": None}))["domain.brief"]
    assert "here: success rates on 3 axes (elevation of the sun, blur and brightness)." in few


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"shifts": {"refused": "it is of another task"}}, "of another task"),
        ({"verdict.good_share": 0.99}, "requires 0.9 of the oracle's success rate"),
        ({"verdict.kind": "poor"}, "this verdict does not"),
    ],
)
def test_what_speaks_against_them_is_said_instead(changes, why):
    evidence = changed(GOOD, changes)
    assert not is_quoted(evidence) and why in why_not(evidence)
    assert list(said(QUOTED, evidence)) == ["domain.refused"]
    assert not_evaluated(evidence) == ["colors", "light", "sizes"]


def test_an_open_verdict_and_a_policy_that_is_good_nowhere_go_together():
    assert is_quoted(changed(GOOD, {"verdict.kind": "poor", "verdict.certain": False}))
    nowhere = {"shifts.domain.plain.good": False, "verdict.kind": "poor"}
    assert is_quoted(changed(GOOD, nowhere))


def test_what_was_not_flown_was_not_evaluated():
    assert not_evaluated(GOOD) == ["colors", "sizes"]
    assert not_evaluated({"verdict": VERDICT}) == ["colors", "light", "sizes"]
