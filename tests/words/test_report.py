"""What is said of each section, word for word, and what is not said where evidence is missing.

That each sentence goes or turns with its evidence: tests/bench/test_sentences.py.
"""

import pytest

from drone_rl.bench.evidence import EXPLANATION, HIGHER, changed
from drone_rl.words.licence import said
from drone_rl.words.report import SECTIONS, SENTENCES


def speak(**changes):
    return said(
        SENTENCES, changed(EXPLANATION, {k.replace("__", "."): v for k, v in changes.items()})
    )


def test_the_data_set():
    assert speak()["dataset.size"] == (
        "600 frames, spread evenly over 30 whole flights of 1,300 steps with sampled actions."
    )
    assert speak()["dataset.actions"] == "Of these steps 80% forward, 10% left and 10% right."
    assert speak()["dataset.entropy"].endswith("(95%: 0.06 to 0.20).")


def test_nearly_always_is_not_always():
    found = speak(dataset__action_shares=[0.0, 0.9999, 0.0001])
    assert "dataset.one_action" not in found
    assert "less than 1% right" in found["dataset.actions"]


def test_no_loop_seen_is_not_never():
    share = {"successes": 0, "trials": 30, "share": 0.0, "lower95": 0.0, "upper95": 0.1157}
    found = speak(loops__loops=0, loops__episodes=share)
    assert found["loops.none"] == (
        "In none of these 30 sampled flights the drone moves back and forth in a loop; up to 12% "
        "of such flights may have one (95%)."
    )
    assert "loops.some" not in found


def test_pairs_are_all_accounted_for():
    assert speak()["contradictions.pairs"] == (
        "Among these 600 frames 5 pairs of alike ones, each frame in one pair at most, are "
        "answered in opposite ways: 2 contradictions (the next cube stands alike in both), "
        "2 justified (it stands elsewhere), 1 unknown (a frame has no next cube)."
    )
    assert "unknown" not in speak(contradictions__unknown=0)["contradictions.pairs"]


def test_a_search_that_found_nothing_proves_nothing():
    assert speak()["class_model.not_reached"] == (
        "None of the 96 attempts made left more probable than not; that no picture does is not "
        "shown by that."
    )


def test_a_picture_of_either_objective_is_one():
    found = speak(class_model__probability__highest=[0.9, 0.51, 0.9])
    assert "class_model.not_reached" not in found


def test_empty_maps_are_counted_and_no_reason_is_made_up():
    found = speak()
    assert found["attribution.stand_in"].startswith("On 1 of the 4 steps shown")
    assert found["attribution.no_heat"] == "On 1 of the 4 steps shown there is no heat at all."
    assert "because" not in " ".join(found.values())


def test_outcomes_are_counted_and_blindness_is_told_of_both_sides():
    found = speak()
    assert found["response.collected"].endswith(
        "from 64 of 72 places on its left, 72 of 72 places ahead and 60 of 72 places on its right."
    )
    assert (
        "60% of the places on the left and 50% of the places on the right"
        in found["response.blind"]
    )
    assert "response.heights" not in found


def test_places_that_are_not_there_are_not_told():
    assert "ahead" not in speak(response__rows__1__places=0)["response.collected"]


def test_other_heights_are_told_where_cubes_stand_there():
    found = speak(response__rows=[*EXPLANATION["response"]["rows"], *HIGHER])
    assert found["response.heights"] == (
        "Where the cube stands 1.2 m higher: from 50 of 72 places on its left, 72 of 72 places "
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


def test_every_section_of_the_page_says_something():
    for name, sentences in SECTIONS.items():
        assert said(sentences, EXPLANATION), name
