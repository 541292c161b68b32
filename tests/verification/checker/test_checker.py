import numpy as np
import pytest

import drone_rl
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.checker.certificate import Outcome, parse_certificate
from drone_rl.verification.checker.checker import (
    CheckFindings,
    Contradiction,
    Rollouts,
    check_certificate,
    ends_as_stated,
)


def findings(data, **settings):
    weights = drone_rl.load_policy(data["policy"]["name"]).state["policy"]
    return check_certificate(parse_certificate(data), weights, **{"flights": 120, **settings})


def test_true_certificates_are_accepted(one_sided, two_halves):
    for data in (one_sided, two_halves):
        found = findings(data)
        assert found.accepted, found.lines()
        assert found.lines() == []
        assert 110 <= sum(found.flights.values()) <= 120
    assert found.flights["border"] == 0


def test_a_lie_that_only_flights_tell_is_refused_with_the_placement(one_sided):
    won, lost = one_sided["outcomes"]
    won["boxes"], lost["boxes"] = lost["boxes"], won["boxes"]
    won["share"], lost["share"] = lost["share"], won["share"]
    won["steps"], lost["steps"] = lost["steps"], won["steps"]
    found = findings(one_sided)
    assert not found.accepted and found.contradicted == sum(found.flights.values())
    first = found.contradictions[0]
    assert first.stated == "all_cubes, cubes collected: 1"
    assert first.found.startswith("front_boundary, cubes collected: none, steps: 2")
    assert 1.65 < first.placement[0] < 6
    assert len(found.lines()) == 21
    told = found.as_dict()
    assert told["contradictions"][0]["placement"] == first.placement
    assert (told["accepted"], told["contradicted"]) == (False, found.contradicted)


def test_a_border_in_the_wrong_place_is_found(one_sided):
    """Off by a twentieth of a millimetre: no flight anywhere is likely to tell."""
    won, lost = one_sided["outcomes"]
    for part, end in (
        (won, 1),
        (one_sided["undecided"], 0),
        (one_sided["undecided"], 1),
        (lost, 0),
    ):
        part["boxes"][0][0][end] += 5e-5
    cut = won["boxes"][0][0][1], lost["boxes"][0][0][0]
    won["share"], lost["share"] = (cut[0] + 6) / 12, (6 - cut[1]) / 12
    one_sided["undecided"]["share"] = (cut[1] - cut[0]) / 12
    for part in (won, lost):
        total = sum(part["steps"].values())
        part["steps"] = {n: 0.97 * part["share"] * s / total for n, s in part["steps"].items()}
    found = findings(one_sided)
    assert {c.where for c in found.contradictions} == {"inside"}  # a corner
    assert found.contradictions[0].placement[0] == pytest.approx(1.65004, abs=1e-5)


def test_what_does_not_go_together_is_not_flown(one_sided):
    one_sided["outcomes"][0]["share"] = 0.5
    found = findings(one_sided)
    assert (found.accepted, found.flights, found.contradicted) == (False, {}, 0)
    assert "has a share of 0.5" in found.lines()[0]


def test_an_answer_of_nothing_is_true(one_sided):
    one_sided |= {"outcomes": [], "undecided": {"share": 1.0, "boxes": [[[-6.0, 6.0]]]}}
    found = findings(one_sided)
    assert found.accepted and sum(found.flights.values()) == 0


LIMIT = EndReason.STEP_LIMIT


@pytest.mark.parametrize(
    ("end", "collected", "repeats", "loops", "steps", "right"),
    [
        (LIMIT, False, 200, True, {300: 0.5}, True),
        (LIMIT, False, 1, True, {300: 0.5}, True),
        (LIMIT, False, 0, True, {300: 0.5}, False),  # does not go to and fro
        (LIMIT, False, 200, False, {300: 0.5}, False),  # does
        (LIMIT, False, 2, False, {300: 0.5}, True),  # began with the end
        (LIMIT, True, 200, True, {300: 0.5}, False),
        (EndReason.SIDE_BOUNDARY, False, 0, True, {300: 0.5}, False),
        (LIMIT, False, 200, True, {299: 0.5}, False),
        (LIMIT, False, 200, True, {299: 0.4}, True),  # of the others the steps are not certain
    ],
)
def test_ends_by_hand(end, collected, repeats, loops, steps, right):
    stated = Outcome(LIMIT, (False,), loops, 0.5, steps, np.zeros((0, 1, 2)))
    flown = Rollouts(*map(np.array, ([int(end)], [[collected]], [300], [repeats])))
    assert ends_as_stated(stated, flown, 0) is right


@pytest.mark.parametrize("stated", [EndReason.FRONT_BOUNDARY, EndReason.SIDE_BOUNDARY])
@pytest.mark.parametrize("ended", [EndReason.FRONT_BOUNDARY, EndReason.SIDE_BOUNDARY, LIMIT])
def test_another_end_is_not_as_stated(stated, ended):
    outcome = Outcome(stated, (False,), False, 0.5, {30: 0.5}, np.zeros((0, 1, 2)))
    flown = Rollouts(*map(np.array, ([int(ended)], [[False]], [30], [0])))
    assert ends_as_stated(outcome, flown, 0) is (stated == ended)


def test_many_contradictions_take_few_lines():
    one = Contradiction("inside", (1.0, 2.0), "a", "b")
    found = CheckFindings(("lie",), (one,) * 30, 5000, {"inside": 9000})
    assert len(found.lines()) == 22
    assert str(one) in found.lines()[1] and "y=[1.0, 2.0]" in str(one)
    assert found.lines()[-1] == "and 4980 flights more ended otherwise than stated"
