"""A claim of a sweep disappears or changes when evidence contradicts it."""

import pytest

from drone_rl.sweeps import text as sweep_text
from drone_rl.utils.text import said
from tests.evidence import SWEEP, changed

SUBJECTS = {
    "sweep": ([sweep_text.SENTENCES], SWEEP),
}
CHANGES = [
    ("sweep", "runs.failed", {"failed": 0}),
    ("sweep", "best.chosen", {"best.certain": False}),
    ("sweep", "sides.not_offered", {"sides_not_offered": 0}),
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
