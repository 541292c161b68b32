"""A claim of a report disappears or changes when evidence contradicts it."""

import pytest

from drone_rl.explanations.report.page import PARTS
from drone_rl.explanations.report.summary import say_summary
from drone_rl.utils.text import said
from tests.evidence import EXPLANATION, PROOF, SAVED_SHIFTS, changed

REPORT = (say_summary, *(paragraph for part in PARTS.values() for paragraph in part.text.values()))
SUBJECTS = {
    "report": (REPORT, EXPLANATION),
}
REPORT_PROVED = {"verdict.proof": PROOF}
GOOD = {"verdict.kind": "good", "verdict.certain": True, "verdict.exit_code": 0}
MEASURED = {"shifts": SAVED_SHIFTS, **GOOD}
CHANGES = [
    ("report", "summary.verdict", {"verdict.certain": False}),
    ("report", "summary.certificate", {"verdict.proof.every": False}, REPORT_PROVED),
    ("report", "summary.robustness", {"shifts.shifts.domain": None}, MEASURED),
    ("report", "summary.heat", {"truth.methods.saliency.trusted": False}),
    ("report", "advice.use", {"verdict.certain": False}, GOOD),
    ("report", "advice.refuse", GOOD),
    ("report", "domain", {"verdict.good_share": 0.99}, MEASURED),
    ("report", "contradictions.worst", {"contradictions.contradictions": 0}),
    ("report", "loops.share", {"loops.episodes.successes": 0}),
    ("report", "attribution.trusted", {"truth.trusted": None}),
    ("report", "response.blind", {"response.rows.0.blind": 0.0}),
    ("report", "places.blind", {"places.alone": 1}),
    ("report", "asymmetry.side", {"asymmetry.dataset.signed.upper95": 0.1}),
    ("report", "truth.trusted", {"truth.placebos.ones.mean": 0.9}),
    ("report", "truth.follows", {"truth.outcomes.follows.lower95": -0.1}),
    ("report", "truth.ground", {"truth.outcomes.ground_changed.upper95": 0.4}),
]  # fmt: skip
"""Subject, sentence, evidence against it, and evidence without which it does not appear."""


@pytest.mark.parametrize("row", CHANGES, ids=lambda row: f"{row[1]}: {sorted(row[2])}")
def test_a_contradicted_claim_is_not_made(row):
    subject, name, against, before = (*row, {})[:4]
    paragraphs, evidence = SUBJECTS[subject]
    evidence = changed(evidence, before)

    def text(evidence):
        return {n: t for p in paragraphs for n, t in said(p, evidence).items()}.get(name)

    assert text(evidence) is not None
    assert text(changed(evidence, against)) != text(evidence)
