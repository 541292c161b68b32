"""What is said of each section, word for word, and what is not said where evidence is missing.

That each sentence goes or turns with its evidence: tests/benchmarks/test_sentences.py.
"""

from benchmarks.evidence import EXPLANATION, changed
from drone_rl.explanations.report.text import SECTIONS, SENTENCES
from drone_rl.utils.text import said


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


def test_every_section_of_the_page_says_something():
    for name, sentences in SECTIONS.items():
        assert said(sentences, EXPLANATION), name
