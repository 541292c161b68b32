"""What is said of one cube wherever it stands, and of left and right, word for word."""

import pytest

from drone_rl.explanations.report.response import say_asymmetry, say_response
from tests.evidence import EXPLANATION, HIGHER, changed


def speak(**changes):
    evidence = changed(EXPLANATION, {k.replace("__", "."): v for k, v in changes.items()})
    return say_response(evidence) | say_asymmetry(evidence)


def test_outcomes_are_counted_and_blindness_is_told_of_both_sides():
    found = speak()
    assert found["response.collected"].endswith(
        "from 64 of 72 places on its left, 72 of 72 places ahead and 60 of 72 places on its right."
    )
    assert (
        "60.0% of the places on its left and 50.0% of the places on its right"
        in found["response.blind"]
    )
    assert "response.heights" not in found


def test_places_that_are_not_there_are_not_told():
    assert "ahead" not in speak(response__rows__1__places=0)["response.collected"]


def test_other_heights_are_told_where_cubes_stand_there():
    found = speak(response__rows=[*EXPLANATION["response"]["rows"], *HIGHER])
    assert found["response.heights"] == (
        "With the cube 1.2 m higher: from 50 of 72 places on its left, 72 of 72 places "
        "ahead and 40 of 72 places on its right."
    )
    assert "64 of 72" in found["response.collected"]  # still those at its own height


@pytest.mark.parametrize(
    ("lower", "upper", "name"),
    [
        (-0.3, -0.1, "prefers"),
        (0.1, 0.3, "prefers"),
        (-0.1, 0.3, "undecided"),
        (0.0, 0.3, "undecided"),
        (-0.3, 0.0, "undecided"),
    ],
)
def test_a_side_is_preferred_if_the_interval_says_so(lower, upper, name):
    signed = {"mean": (lower + upper) / 2, "lower95": lower, "upper95": upper}
    found = speak(asymmetry__dataset__signed=signed)
    assert {n for n in found if n in ("asymmetry.prefers", "asymmetry.undecided")} == {
        f"asymmetry.{name}"
    }
    if name == "prefers":
        side = "left" if lower > 0 else "right"
        assert (
            f"prefers the {side}, by 0.20 in probability (95%: 0.10 to 0.30)"
            in found["asymmetry.prefers"]
        )


def test_nothing_is_said_of_places_that_were_not_flown():
    rows = [{**row, "places": 0} for row in EXPLANATION["response"]["rows"]]
    assert "response.collected" not in speak(response__rows=rows)


@pytest.mark.parametrize(("row", "is_told"), [(0, False), (1, True), (2, False)])
def test_blindness_is_told_only_if_both_sides_call_for_a_turn(row, is_told):
    assert ("response.blind" in speak(**{f"response__rows__{row}__blind": None})) is is_told


def test_how_far_it_is_from_its_mirror_image():
    assert speak()["asymmetry.differs"] == (
        "On these frames the policy differs from its mirror image by 0.30 on average (0: "
        "perfectly symmetric, 1: always opposite; 95%: 0.20 to 0.40), over the places of the "
        "response map by 0.25."
    )
