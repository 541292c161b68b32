"""Numbers, intervals and conditions of the report's sentences.

tests/test_claims.py checks that every sentence changes with the evidence under it.
"""

import pytest

from drone_rl.explanations.report import behavior
from drone_rl.explanations.report.attribution import say_attribution
from drone_rl.explanations.report.class_models import say_class_models
from drone_rl.explanations.report.page import PARTS
from drone_rl.explanations.report.response import say_asymmetry, say_response
from drone_rl.explanations.report.summary import LINES, say_summary
from drone_rl.explanations.report.truth import say_findings, say_reasons
from drone_rl.utils.text import said
from tests.evidence import EXPLANATION, HIGHER, PROOF, SAVED_SHIFTS, changed

NONE_TRUSTED = {
    "truth.trusted": None,
    "truth.methods.saliency.trusted": False,
    "truth.methods.saliency.failed": ["likeness"],
}


def claims(changes=None):
    evidence = changed(EXPLANATION, changes or {})
    paragraphs = (text for part in PARTS.values() for text in part.text.values())
    return {name: text for one in paragraphs for name, text in said(one, evidence).items()}


def test_numbers_come_with_intervals_and_conditions():
    found = claims()
    for name, parts in {
        "dataset.size": ("600 frames", "30 whole episodes", "60 cubes collected"),
        "dataset.actions": ("80.0% forward, 10.0% left and 10.0% right",),
        "dataset.entropy": ("0.10", "(95%: 0.06 to 0.20)"),
        "tsne.faithful": ("10 nearest neighbours", "features 80.0% (chance: 2.0%"),
        "contradictions.pairs": ("2 contradictions", "2 justified", "1 unknown"),
        "loops.share": ("3 of 30", "(95%: 2.0% to 27.0%)"),
        "truth.trusted": (
            "saliency", "(score 0.50, 95%: 0.40 to 0.60)", "'horizon': 0.30",
            "60.0% of these frames (chance: 10.0%)",
        ),
        "truth.left_out": ("Of 300 frames 20",),
        "truth.follows": ("60 rollouts", "0.80 m per metre (95%: 0.60 to 0.95)"),
        "truth.ground": ("2.0%", "(95%: 0% to 10.0%)"),
        "truth.effects": ("target taken away 0.40 (95%: 0.30 to 0.50)",),
        "response.collected": ("64 of 72 places on its left", "72 of 72 places ahead"),
        "response.blind": ("60.0% of the places on its left and 50.0%", "less than 0.1"),
        "asymmetry.differs": ("0.30 on average", "95%: 0.20 to 0.40", "0.25"),
        "asymmetry.side": ("-0.20", "(95%: -0.30 to -0.10; below 0: right)"),
    }.items():  # fmt: skip
        assert all(part in found[name] for part in parts), found[name]


def test_a_rate_close_to_one_is_not_called_certain():
    found = behavior.say_dataset(
        changed(EXPLANATION, {"dataset.action_shares": [0.0, 0.9999, 0.0001]})
    )
    assert "100% left" not in found["dataset.actions"]
    assert "<0.1% right" in found["dataset.actions"]


def test_no_loop_in_these_episodes_has_an_upper_limit():
    share = {"successes": 0, "trials": 30, "share": 0.0, "lower95": 0.0, "upper95": 0.1157}
    found = claims({"loops.loops": 0, "loops.longest": 0, "loops.episodes": share})
    assert "0 of 30" in found["loops.share"] and "to 11.6%" in found["loops.share"]


@pytest.mark.parametrize(
    ("verdict", "name", "part"),
    [
        ({"kind": "good", "certain": True, "exit_code": 0}, "use", "in no others"),
        ({"kind": "poor", "certain": True, "exit_code": 10}, "refuse", "exit status 10"),
        ({"kind": "good", "certain": False, "enough": 1600}, "more", "(episodes=1600)"),
        ({"kind": "poor", "certain": False, "enough": None}, "more", "many more episodes"),
    ],
)
def test_advice_depends_on_the_verdict(verdict, name, part):
    evidence = changed(EXPLANATION, {f"verdict.{k}": v for k, v in verdict.items()})
    advice = behavior.say_advice(evidence)
    assert list(advice) == [f"advice.{name}"] and part in advice[f"advice.{name}"]


def test_appearances_that_were_not_tested_are_named():
    (scope,) = behavior.say_scope(EXPLANATION).values()
    assert "nothing here tests other colors, light or sizes" in scope


def test_the_page_names_the_file_of_its_figures():
    (source,) = behavior.say_source(EXPLANATION).values()
    assert "a/explanation.json" in source and "0123abc" in source and "2026-01-31" in source


def test_class_models_that_were_not_found_prove_nothing():
    found = say_class_models(EXPLANATION)["class_model.not_reached"]
    assert "None of the 96 attempts made left" in found and "does not show" in found
    either = changed(EXPLANATION, {"class_model.probability.highest": [0.9, 0.51, 0.9]})
    assert "class_model.not_reached" not in say_class_models(either)


def test_a_heat_map_is_named_only_if_it_passed():
    assert "saliency" in say_attribution(EXPLANATION)["attribution.trusted"]
    for none in (changed(EXPLANATION, NONE_TRUSTED), {**EXPLANATION, "truth": None}):
        (text,) = say_attribution(none).values()
        assert "Do not trust" in text
    found = claims(NONE_TRUSTED)
    assert "truth.none" in found and "truth.trusted" not in found
    assert "saliency" in found["truth.refused"] and "occlusion" in found["truth.refused"]


def test_without_any_effect_of_a_patch_no_map_is_verified():
    evidence = changed(EXPLANATION, {**NONE_TRUSTED, "truth.frames": 0})
    found = say_findings(evidence) | say_reasons(evidence)
    assert "truth.unmoved" in found
    assert not {"truth.trusted", "truth.none", "truth.refused"} & set(found)


def test_missing_measurements_are_not_mentioned():
    nothing = {"mean": None, "lower95": None, "upper95": None}
    found = claims({"truth.interventions.ground patch changed": nothing, "truth.outcomes": None})
    assert "ground patch" not in found["truth.effects"]
    assert "truth.ground" not in found and "truth.follows" not in found


def test_the_response_is_given_by_height_and_side():
    rows = EXPLANATION["response"]["rows"]
    found = say_response(changed(EXPLANATION, {"response.rows": [*rows, *HIGHER]}))
    assert "from 64 of 72 places on its left" in found["response.collected"]
    assert "from 50 of 72 places on its left" in found["response.collected"]
    assert "with the cube at +1.2 m" in found["response.collected"]
    ahead = say_response(changed(EXPLANATION, {"response.rows.1.places": 0}))
    assert "ahead" not in ahead["response.collected"]
    none = [{**row, "places": 0} for row in rows]
    assert "response.collected" not in say_response(changed(EXPLANATION, {"response.rows": none}))


@pytest.mark.parametrize(("row", "is_said"), [(0, False), (1, True), (2, False)])
def test_blindness_needs_a_turn_on_both_sides(row, is_said):
    found = say_response(changed(EXPLANATION, {f"response.rows.{row}.blind": None}))
    assert ("response.blind" in found) is is_said


def test_asymmetry_has_a_sign():
    signed = {"mean": 0.2, "lower95": 0.1, "upper95": 0.3}
    found = say_asymmetry(changed(EXPLANATION, {"asymmetry.dataset.signed": signed}))
    assert "+0.20 in probability (95%: +0.10 to +0.30" in found["asymmetry.side"]


def test_the_summary_has_one_line_for_each_question():
    assert list(say_summary(EXPLANATION)) == list(LINES)
    assert list(say_summary({})) == ["summary.robustness", "summary.limits"]
    assert "60.0% (95% CI 58.0% to 62.0%) of 400" in say_summary(EXPLANATION)["summary.success"]


def test_the_summary_says_no_more_than_was_measured():
    def line(name, changes=None):
        return say_summary(changed(EXPLANATION, changes or {}))[f"summary.{name}"]

    shifts = {"shifts": SAVED_SHIFTS, "verdict.kind": "good"}
    assert "2 of 3 perturbations" in line("robustness", shifts)
    same = changed(SAVED_SHIFTS, {"shifts.axes.blur.levels.1.modes.constant.unchanged": True})
    assert "1 of 2 perturbations" in line("robustness", {**shifts, "shifts": same})
    assert "another task" in line(
        "robustness", {"shifts": {"path": "a", "refused": "it is of another task"}}
    )
    assert "Not measured" in line("robustness")
    assert "1,000 rollouts" in line("certificate", {"verdict.proof": PROOF})
    unchecked = {"verdict.proof": {**PROOF, "wrong_at_most": None}}
    assert "not a proof" in line("certificate", unchecked)
    assert "1 of 2 methods passed the tests: trust saliency" in line("heat")
    assert "no heat map" in line("heat", NONE_TRUSTED)
    assert "colors, light or sizes" in line("limits") and "embedding" in line("limits")
