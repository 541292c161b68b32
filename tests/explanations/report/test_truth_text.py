from drone_rl.explanations.report.truth import best_placebo, say_findings, say_reasons
from tests.evidence import EXPLANATION, changed

NONE = {
    "truth.trusted": None,
    "truth.methods.saliency.trusted": False,
    "truth.methods.saliency.failed": ["likeness"],
}


def speak(changes=None):
    evidence = changed(EXPLANATION, changes or {})
    return say_findings(evidence) | say_reasons(evidence)


def test_the_map_to_trust_stands_beside_the_best_placebo():
    found = speak()
    assert "The heat map to trust is saliency" in found["truth.trusted"]
    assert "(score 0.50, 95%: 0.40 to 0.60)" in found["truth.trusted"]
    assert "(the best on the same frames, 'horizon': 0.30)" in found["truth.trusted"]
    assert "60.0% of these frames (chance: 10.0%)" in found["truth.hits"]
    assert "truth.none" not in found
    assert best_placebo(EXPLANATION["truth"]) == "horizon"


def test_a_map_that_is_not_trusted_gets_its_reasons():
    assert speak()["truth.refused"] == (
        "Not trusted: occlusion (not reliably better than the placebo 'ones' and 1 other; "
        "its hottest patch does not reliably affect the policy more often than chance)."
    )


def test_none_is_a_result():
    found = speak(NONE)
    assert found["truth.none"] == "No heat map of this policy can be trusted."
    assert (
        "saliency (it does not reliably change when the weights are shuffled)"
        in (found["truth.refused"])
    )
    assert "truth.trusted" not in found and "truth.hits" not in found


def test_of_a_policy_that_nothing_moves_only_that_is_said():
    found = speak({**NONE, "truth.frames": 0})
    assert {n for n in found if n.split(".")[1] in ("trusted", "none", "refused", "unmoved")} == {
        "truth.unmoved"
    }


def test_what_changes_do_is_said_with_its_bounds():
    found = speak()
    assert "no more than 0.20 of 1" in found["truth.patch"]
    assert "by 0.40 of 1 (95%: 0.30 to 0.50)" in found["truth.target"]
    assert "0.0010 on average and 0.0070 at most, on 30 frames" in found["truth.integral"]
    weak = {"truth.interventions.ground patch changed.upper95": 0.3}  # as much as the cube's least
    assert "truth.target" not in speak(weak)
    none = {"truth.interventions.ground patch changed.upper95": None}
    assert not {"truth.target", "truth.patch"} & set(speak(none))
    assert "truth.ground" not in speak({"truth.outcomes": None})
