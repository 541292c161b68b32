"""Sentences on the recorded rollouts, contradictions and loops, word for word."""

from drone_rl.explanations.report.behavior import say_contradictions, say_dataset, say_loops
from tests.evidence import EXPLANATION, changed


def speak(**changes):
    evidence = changed(EXPLANATION, {k.replace("__", "."): v for k, v in changes.items()})
    return say_dataset(evidence) | say_contradictions(evidence) | say_loops(evidence)


def test_the_data_set():
    assert speak()["dataset.size"] == (
        "600 frames, spread evenly over 30 whole episodes of 1,300 steps with sampled actions."
    )
    assert speak()["dataset.actions"] == "Actions taken: 80.0% forward, 10.0% left and 10.0% right."
    assert speak()["dataset.entropy"].endswith("(95%: 0.06 to 0.20).")


def test_nearly_always_is_not_always():
    found = speak(dataset__action_shares=[0.0, 0.9999, 0.0001])
    assert "dataset.one_action" not in found
    assert "less than 0.1% right" in found["dataset.actions"]


def test_no_loop_seen_is_not_never():
    share = {"successes": 0, "trials": 30, "share": 0.0, "lower95": 0.0, "upper95": 0.1157}
    found = speak(loops__loops=0, loops__episodes=share)
    assert found["loops.none"] == (
        "None of these 30 sampled episodes has a loop, in which the drone moves back and forth; up "
        "to 11.6% of such episodes may have one (95%)."
    )
    assert "loops.some" not in found


def test_pairs_are_all_accounted_for():
    assert speak()["contradictions.pairs"] == (
        "Among these 600 frames, 5 pairs of similar ones get opposite actions (each frame is in "
        "one pair at most): 2 contradictions (the next cube is at about the same place in both), "
        "2 justified (it is elsewhere), 1 unknown (a frame has no next cube)."
    )
    assert "unknown" not in speak(contradictions__unknown=0)["contradictions.pairs"]
