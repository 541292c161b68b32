"""Sentences of the report: each goes or changes when the result contradicts it."""

import re

import pytest

from drone_rl.explanations.report import page
from tests.evidence import PROOF
from tests.explanations.example import PICTURED, changed_explanation, mean

GOOD = {"verdict.kind": "good", "verdict.certain": True, "verdict.exit_code": 0}
UNCERTAIN = {"verdict.certain": False}
MEASURED = {**GOOD, "shifts": PICTURED}
NONE_TRUSTED = {
    "truth.trusted": None,
    "truth.methods.saliency.trusted": False,
    "truth.methods.saliency.failed": ["random weights"],
}
TRUSTED = {
    "truth.trusted": "saliency",
    "truth.methods.saliency.trusted": True,
    "truth.methods.saliency.failed": [],
}


@pytest.fixture
def text(tmp_path, monkeypatch):
    """Returns the words of a section of the page, or of the summary."""
    monkeypatch.setattr(page, "save_drawn", lambda *_: "data:,")

    def words(section, changes):
        policies = [changed_explanation(changes)]
        if section == "summary":
            html = page.render_summary(policies)
        else:
            html = page.render_section(section, policies, tmp_path)
        visible = re.sub(r"<script.*?</script>|<[^>]+>", " ", html, flags=re.S)
        return re.sub(r"\s+", " ", visible)

    return words


@pytest.mark.parametrize(
    ("section", "sentence", "against", "before"),
    [
        ("summary", "verdict errs in at most 5% of cases", UNCERTAIN, GOOD),
        ("summary", "in 60.0% (95% CI 58.0% to 62.0%) of 400", {"verdict": None}, {}),
        ("summary", "good with the sun at 21.1", {"shifts.shifts.domain": None}, MEASURED),
        ("summary", "(drone-rl shifts measures them", MEASURED, {}),
        ("summary", "changes the outcome of 2.0%", {"truth.outcomes": None}, {}),
        ("summary", "another task", MEASURED,
         {"shifts": {"path": "a", "refused": "it is of another task"}}),
        ("summary", "not refuted by 3,000 episodes", {"verdict.proof.computed": True},
         {"verdict.proof": PROOF}),
        ("summary", "1 of 2 methods passed the tests: trust saliency.", NONE_TRUSTED, {}),
        ("summary", "2 to 4 m ahead", {"places": None}, {}),
        ("summary", "other colors, light or sizes", MEASURED, {"truth.outcomes": None}),
        ("summary", "; other light or sizes", {"truth.outcomes": None}, {}),
        ("verdict", "tests other light or sizes", MEASURED, {}),
        ("summary", "what was left out (embedding)", {"left_out": {}}, {}),
        ("verdict", "rely on it in environments like those tested", UNCERTAIN, GOOD),
        ("verdict", "do not rely on it; drone-rl verdict", GOOD, {}),
        ("verdict", "more episodes (episodes=400)", {"verdict.enough": None}, UNCERTAIN),
        ("verdict", "fitted to the environments, frames", {"seed_is_fixed": False}, {}),
        ("dataset", "80.0% forward, 10.0% left, 10.0% right.",
         {"dataset.action_shares": [0.0, 0.9999, 0.0001]}, {}),
        ("flaws", "1 contradictions, 0 justified, 1 unknown.", {"flaws.pairs": []}, {}),
        ("flaws", "gains at least 0.70", {"flaws.pairs.0.kind": "justified"}, {}),
        ("flaws", "In 3 of 30 sampled episodes", {"flaws.loops": []}, {}),
        ("class_model", "None of the 96 attempts made left more probable",
         {"class_model.probability.highest": [0.9, 0.51, 0.9]}, {}),
        ("attribution", "Shown: saliency, which passed", NONE_TRUSTED, {}),
        ("attribution", "Do not trust the maps below", TRUSTED, NONE_TRUSTED),
        ("attribution", "Grad-CAM of layer relu2", {"attribution.layer": None}, {}),
        ("truth", "The heat map to trust is saliency", NONE_TRUSTED, {}),
        ("truth", "(the best one, horizon: 0.30)", {"truth.placebos.ones.mean": 0.9}, {}),
        ("truth", "it scores as well on shuffled weights", TRUSTED, NONE_TRUSTED),
        ("truth", "No heat map of this policy can be trusted", {"truth.frames": 0}, NONE_TRUSTED),
        ("truth", "could be verified: trust none", {"truth.frames": 5}, {"truth.frames": 0}),
        ("truth", "follow it by 0.80 (95% CI 0.60 to 0.95)", {"truth.outcomes": None}, {}),
        ("truth", "the outcome of 2.0%", {"truth.outcomes.ground_changed.mean": 0.4}, {}),
        ("response", "from 64 of 72 places on its left, 72 of 72 places ahead",
         {"response.rows.1.places": 0}, {}),
        ("response", "with the cube at +1.2 m, the policy collects the cube from 50 of 72",
         {"response.rows.3.places": 0}, {}),
        ("response", "at 60.0% of the places on its left, 50.0%",
         {"response.rows.0.blind": None}, {}),
        ("summary", "depend on depth, of depth and goal", {"importance": None}, {}),
        ("importance", "The actions depend on depth: they change by 0.200 (99.8% CI 0.100",
         {"importance.inputs.depth.matters": False}, {}),
        ("importance", "hardly depend on goal", {"importance.inputs.goal.excess.upper": 0.02}, {}),
        ("importance", "not certain whether the actions depend on goal",
         {"importance.inputs.goal.matters": True}, {"importance.inputs.goal.excess.upper": 0.02}),
        ("asymmetry", "-0.20 (95% CI -0.30 to -0.10) in probability",
         {"asymmetry.signed": mean(0.2, 0.1, 0.3)}, {}),
        ("places", "75.00% of those on its left and 50.00% of those on its right",
         {"places.blind": 0}, {}),
        ("left_out", "It has no layers.", {"left_out.embedding": "It is flat."}, {}),
    ],
)  # fmt: skip
def test_a_contradicted_sentence_is_not_shown(text, section, sentence, against, before):
    assert sentence in text(section, before)
    assert sentence not in text(section, {**before, **against})


def test_the_summary_begins_with_the_largest_effect(text):
    """In 40% of its episodes the policy fails; a ground that changes more outcomes comes first."""
    for changed_outcomes, first in ((0.39, "It fails in 40.0%"), (0.41, "Another ground color")):
        words = text("summary", {"truth.outcomes.ground_changed.mean": changed_outcomes})
        assert words.split("effect on success first.")[1].strip().startswith(first)
