import numpy as np
import pytest

from drone_rl.verification.checker.certificate import parse_certificate
from drone_rl.verification.checker.consistency import find_inconsistencies, missing_steps


def lies(data):
    return list(find_inconsistencies(parse_certificate(data)))


def test_true_certificates_go_together(one_sided, two_halves):
    assert lies(one_sided) == []
    assert lies(two_halves) == []


def test_a_twentieth_of_the_steps_may_be_left_open(two_halves):
    won = two_halves["outcomes"][0]
    for stated, accepted in ((0.951, True), (0.949, False)):
        won["steps"] = {"20": stated}
        assert (lies(two_halves) == []) == accepted


def test_steps_may_add_up_to_their_share_up_to_rounding(one_sided):
    won = one_sided["outcomes"][0]
    for excess, accepted in ((1e-13, True), (1e-9, False)):
        won["steps"] = {"20": won["share"] * (1 + excess)}
        assert (lies(one_sided) == []) == accepted


def test_a_rare_outcome_may_leave_its_steps_open(one_sided):
    """As one between boxes of which it is not certain by which way they ended."""
    won, lost = one_sided["outcomes"]
    cut = lost["boxes"][0][0][0]
    for extra, accepted in ((0.011, True), (0.013, False)):
        rare = {"end": "side_boundary", "collected": [False], "loops": False, "steps": {}}
        rare |= {"share": extra / 12, "boxes": [[[cut, cut + extra]]]}
        left = {**lost, "boxes": [[[cut + extra, 6.0]]], "share": (6.0 - cut - extra) / 12}
        rare["share"] = (cut + extra - cut) / 12
        left["steps"] = {"27": 0.99 * left["share"]}
        one_sided["outcomes"] = [won, left, rare]
        assert (lies(one_sided) == []) == accepted, lies(one_sided)


def test_what_is_missing_of_the_steps(parsed, two_halves):
    won, lost = parsed.outcomes
    assert 0 < missing_steps(won) < 2e-5
    lost.steps.clear()
    assert missing_steps(lost) == lost.share
    lost.steps[27] = np.nextafter(lost.share, 0)
    assert missing_steps(lost) == 0.0


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"share": 0.6}, "has a share of 0.6, but boxes of 0.637"),
        ({"end": "side_boundary"}, "if and only if all are collected"),
        ({"collected": [False]}, "if and only if all are collected"),
        ({"loops": True}, "an oscillation ends at the step limit"),
        ({"steps": {"301": 0.1}}, "has more steps than step_limit=300"),
        ({"steps": {"14": 0.5, "15": 0.5}}, "has a share of 0.637"),
        (
            {"end": "step_limit", "collected": [False], "steps": {"299": 0.1}},
            "another number of steps than step_limit=300",
        ),
        ({"steps": {}}, "outcome 0 (all_cubes, cubes collected: 1) states no number of steps"),
        ({"steps": {"14": 1e-12}}, "numbers of steps are left open for a share of 0.637"),
        ({"boxes": [[[-6.0, 1.6]]]}, "0 of them contain the placement [1.62"),
        ({"boxes": [[[-6.5, 1.649]]]}, "1 of them contain the placement [-6.25]"),
        ({"boxes": [[[-6.0, 6.0]]]}, "the boxes have 1.36"),
    ],
)
def test_each_lie_is_told_in_a_line(one_sided, change, line):
    one_sided["outcomes"][0] |= change
    found = lies(one_sided)
    assert any(line in one for one in found), found
    assert not any("\n" in one for one in found)


def test_outcomes_are_told_once(two_halves):
    won = two_halves["outcomes"][0]
    halves = [
        {**won, "steps": {"20": s}, "share": s, "boxes": [b]}
        for s, b in zip((7 / 12, 5 / 12), won["boxes"], strict=True)
    ]
    two_halves["outcomes"] = halves
    assert lies(two_halves) == ["outcomes 0 and 1 are the same: all_cubes, cubes collected: 1, 2"]


def test_what_is_undecided(one_sided, two_halves):
    one_sided["undecided"]["share"] *= 1.001
    assert "undecided has a share of" in lies(one_sided)[0]
    two_halves["finished"] = False
    assert lies(two_halves) == ["finished is false, but nothing is undecided"]
