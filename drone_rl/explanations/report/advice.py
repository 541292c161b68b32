"""What to do about a verdict, and what it does not cover. Evidence: `explanation.json`."""

from drone_rl.evaluation.verdict_text import depends_on_rounding
from drone_rl.robustness.domain_text import is_quoted, untested
from drone_rl.utils.text import Evidence, Sentence, is_fixed, listed, seed_of


def _more(evidence: Evidence) -> str:
    if depends_on_rounding(evidence["verdict"]):
        return "What to do: do not rely on it; more episodes do not change that."
    enough = evidence["verdict"]["enough"]
    if enough is None:
        return "What to do: fly many more episodes, or do not rely on it; this may stay open."
    return f"What to do: fly more episodes (episodes={enough}) before relying on it."


def _refuse(evidence: Evidence) -> str:
    return (
        "What to do: do not rely on it; drone-rl verdict with require=good ends with exit status "
        f"{evidence['verdict']['exit_code']}."
    )


def _is_good(evidence: Evidence) -> bool:
    return evidence["verdict"]["kind"] == "good"


def _is_certain(evidence: Evidence) -> bool:
    return evidence["verdict"]["certain"]


ADVICE = (
    Sentence("advice.more", "the verdict is not certain", lambda e: not _is_certain(e), _more),
    Sentence(
        "advice.use",
        "the policy is good, certainly",
        lambda e: _is_certain(e) and _is_good(e),
        lambda e: "What to do: rely on it in worlds like those tested, and in no others.",
    ),
    Sentence(
        "advice.refuse",
        "the policy is something else, certainly",
        lambda e: _is_certain(e) and not _is_good(e),
        _refuse,
    ),
)

SCOPE = (
    Sentence(
        "scope.one_look",
        "other colours, light or sizes were not flown",
        lambda e: bool(untested(e)),
        lambda e: (
            f"{'The verdict is of' if is_quoted(e) else 'Tested in'} one look and one light only, "
            f"those of its task: nothing here tests other {listed(untested(e), 'or')}."
        ),
    ),
)

SEED = (
    Sentence(
        "explanation.fixed_seed",
        "the seed was known before the analysis",
        is_fixed,
        lambda e: (
            f"Fixed seed {seed_of(e)}: a policy could have been fitted to the environments, frames "
            "and placements of all sections."
        ),
    ),
)

SECTIONS = {"advice": ADVICE, "scope": SCOPE, "seed": SEED}
"""Sentences by the part of the page in which they stand."""
SENTENCES = (*ADVICE, *SCOPE, *SEED)
