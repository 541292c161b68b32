"""A claim of a verdict or sweep disappears or changes when evidence contradicts it."""

import pytest

from drone_rl.sweeps import text as sweep_text
from drone_rl.trust import shifts_text, verdict_text
from drone_rl.utils.text import said
from tests.evidence import PROOF, SHIFTS, SWEEP, VERDICT, changed

SUBJECTS = {
    "verdict": ([verdict_text.SENTENCES], VERDICT),
    "sweep": ([sweep_text.SENTENCES], SWEEP),
    "shifts": ([shifts_text.SHIFTS], SHIFTS),
}
TRIVIAL = {"baselines.forward.success.share": 0.95}
NEVER_FAILED = {"failures.largest": None, "failures.bound.successes": 0}
WIND = {"unlike": {"wind": {"own": [0.0, 0.0, 0.0], "flown": [5.0, 0.0, 0.0]}}}
UNDECIDED = {"certain": False, "enough": 1600}
PROVED = {"proof": PROOF}
NOWHERE_GOOD = {
    "domain.plain.good": False,
    **{f"domain.ranges.{axis}.positions": None for axis in ("sun", "blur", "brightness")},
}
CHANGES = [
    ("verdict", "kind", {"certain": False}),
    ("verdict", "open", {"certain": True}, UNDECIDED),
    ("verdict", "rounding", {"rounding.decides": False},
     {"certain": False, "rounding.decides": True}),
    ("verdict", "arithmetic", {"rounding.bound": False}),
    ("verdict", "proof.every", {"proof.every": False}, PROVED),
    ("verdict", "proof.basis", {"proof.wrong_at_most": 0.02}, PROVED),
    ("verdict", "shares", {f"greedy.shares.{side}.mean": 1.0 for side in ("left", "right")}),
    ("verdict", "baselines", TRIVIAL),
    ("verdict", "pointless", {"baselines.forward.success.share": 0.3}, TRIVIAL),
    ("verdict", "failures.largest", {"failures.rows.1.lower95": 0.0}),
    ("verdict", "failures.never", {"failures.bound.successes": 1}, NEVER_FAILED),
    ("verdict", "unlike", {"unlike": {}}, WIND),
    ("verdict", "drawing", {"drawing.upper95": 0.05}),
    ("verdict", "fixed_seed", {"seed_is_fixed": False}),
    ("sweep", "runs.failed", {"failed": 0}),
    ("sweep", "best.chosen", {"best.certain": False}),
    ("sweep", "sides.not_offered", {"sides_not_offered": 0}),
    ("shifts", "shifts.good", {"domain.ranges.sun.high_open": False}),
    ("shifts", "shifts.not", {"domain.ranges.brightness.failed.0.bad": False}),
    ("shifts", "shifts.none", {"domain.plain.good": True}, NOWHERE_GOOD),
    ("shifts", "shifts.impossible", {"axes.sun.levels.1.impossible": False}),
    ("shifts", "shifts.together", {"together.modes.constant.success.share": 0.5}),
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
