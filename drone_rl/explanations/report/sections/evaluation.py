"""The verdict, the flights it rests on, and how the policy fails."""

from drone_rl.explanations.report.advice import ADVICE, SCOPE, SEED
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.truth_text import NAMES
from drone_rl.utils.text import seed_line

PART = Part(
    title="Verdict",
    label="Verdict",
    place=10,
    needs=("verdict",),
    words={"advice": ADVICE, "scope": SCOPE, "seed": SEED},
    extras=lambda explanation: {
        "trusted": _trusted(explanation.numbers.get("truth")),
        "seed": seed_line(explanation.numbers),
    },
)


def _trusted(truth: dict | None) -> str:
    """The heat map to trust, as people call it."""
    return NAMES.get(truth["trusted"], "none") if truth else "none was tested"
