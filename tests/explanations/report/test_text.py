"""Sentences of the report: each goes or changes when the result contradicts it."""

import re

import pytest

from drone_rl.explanations.report import page
from tests.explanations.example import PICTURED, changed_explanation

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
        ("summary", "changes the outcome of 2.0%", {"truth.outcomes": None}, {}),
        ("summary", "another task", MEASURED,
         {"shifts": {"path": "a", "refused": "it is of another task"}}),
        ("summary", "1 of 2 methods passed the tests: trust saliency.", NONE_TRUSTED, {}),
        ("summary", "other colors, light or sizes", MEASURED, {"truth.outcomes": None}),
        ("verdict", "rely on it in environments like those tested", UNCERTAIN, GOOD),
        ("verdict", "do not rely on it; drone-rl verdict", GOOD, {}),
        ("verdict", "fitted to the environments, frames", {"seed_is_fixed": False}, {}),
        ("flaws", "1 contradictions, 0 justified, 1 unknown.", {"flaws.pairs": []}, {}),
        ("flaws", "In 3 of 30 sampled episodes", {"flaws.loops": []}, {}),
        ("attribution", "Shown: saliency, which passed", NONE_TRUSTED, {}),
        ("attribution", "Do not trust the maps below", TRUSTED, NONE_TRUSTED),
        ("truth", "The heat map to trust is saliency", NONE_TRUSTED, {}),
        ("truth", "No heat map of this policy can be trusted", {"truth.frames": 0}, NONE_TRUSTED),
        ("truth", "could be verified: trust none", {"truth.frames": 5}, {"truth.frames": 0}),
        ("response", "with the cube at +1.2 m, the policy collects the cube from 50 of 72",
         {"response.rows.3.places": 0}, {}),
        ("response", "at 60.0% of the places on its left, 50.0%",
         {"response.rows.0.blind": None}, {}),
        ("importance", "The actions depend on depth: they change by 0.200 (99.8% CI 0.100",
         {"importance.inputs.depth.matters": False}, {}),
        ("importance", "not certain whether the actions depend on goal",
         {"importance.inputs.goal.matters": True}, {"importance.inputs.goal.excess.upper": 0.02}),
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
