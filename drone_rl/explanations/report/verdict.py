"""The verdict, its scope and what to do, robustness, what is left out, and the page's source.

Evidence of all sentences: `explanation.json`; of `SOURCE` also "source", the name of that file.
"""

from drone_rl.evaluation.plots.saving import Rows
from drone_rl.evaluation.verdict_text import depends_on_rounding
from drone_rl.explanations.report.explanation import Drawn, Explanation, Part
from drone_rl.explanations.report.validation import METHOD_NAMES
from drone_rl.robustness import charts
from drone_rl.robustness.shifts_text import QUOTED, is_quoted, rows, untested
from drone_rl.utils.schema import as_mapping
from drone_rl.utils.text import Evidence, Sentence, is_fixed, listed, seed_line, seed_of

SOURCE = (
    Sentence(
        "source.file",
        "always",
        lambda e: True,
        lambda e: (
            f"This page repeats what {e['source']} says (written "
            f"{e.get('date') or 'on an unknown date'}, revision "
            f"{as_mapping(e.get('provenance', {}), 'provenance').get('git_revision') or 'unknown'})"
            ". The figures were read from this file and not measured again."
        ),
    ),
)


def _is(evidence: Evidence, is_certain: bool, is_good: bool | None = None) -> bool:
    """Return whether the verdict is certain, or not, and good, or not; None allows both."""
    verdict = evidence["verdict"]
    return verdict["certain"] == is_certain and is_good in (None, verdict["kind"] == "good")


def _more_episodes(evidence: Evidence) -> str:
    if depends_on_rounding(evidence["verdict"]):
        return "What to do: do not rely on it; more episodes do not change that."
    enough = evidence["verdict"]["enough"]
    if enough is None:
        return "What to do: evaluate many more episodes, or do not rely on it; this may stay open."
    return f"What to do: evaluate more episodes (episodes={enough}) before relying on it."


ADVICE = (
    Sentence("advice.more", "the verdict is not certain", lambda e: _is(e, False), _more_episodes),
    Sentence(
        "advice.use",
        "the verdict is good and certain",
        lambda e: _is(e, True, True),
        lambda e: "What to do: rely on it in environments like those tested, and in no others.",
    ),
    Sentence(
        "advice.refuse",
        "the verdict is not good, and certain",
        lambda e: _is(e, True, False),
        lambda e: (
            "What to do: do not rely on it; drone-rl verdict with require=good ends with exit "
            f"status {e['verdict']['exit_code']}."
        ),
    ),
)


SCOPE = (
    Sentence(
        "scope.one_look",
        "the policy was not evaluated with other colours, light or sizes",
        lambda e: bool(untested(e)),
        lambda e: (
            f"{'The verdict holds for' if is_quoted(e) else 'Tested in'} one appearance and one "
            "light only, those of its task: nothing here tests other "
            f"{listed(untested(e), 'or')}."
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
LEFT_OUT = (
    Sentence(
        "left_out.why",
        "some sections could not be computed for this policy",
        lambda e: bool(e.get("left_out")),
        lambda e: " ".join(e["left_out"].values()),
    ),
)


def _evaluation_extras(explanation: Explanation) -> dict[str, str]:
    truth = explanation.numbers.get("truth")
    trusted = METHOD_NAMES.get(truth["trusted"], "none") if truth else "none was tested"
    return {"trusted": trusted, "seed": seed_line(explanation.numbers)}


EVALUATION_PART = Part(
    title="Verdict",
    label="Verdict",
    needs=("verdict",),
    text={"advice": ADVICE, "scope": SCOPE, "seed": SEED},
    extras=_evaluation_extras,
)


def _draw_shifts(explanation: Explanation) -> Drawn:
    """Draw curves and rows of frames, unless the measurement is refused."""
    numbers = explanation.numbers["shifts"]
    if not is_quoted(explanation.numbers):
        return {}
    frames = {name: [*explanation.arrays[f"shifts_{name}"]] for name in numbers["axes"]}
    return {"shifts": charts.chart(numbers), "conditions": charts.strips(numbers, frames)}


def _shifts_tables(explanation: Explanation) -> dict[str, Rows]:
    return {"shifts": rows(explanation.numbers["shifts"])} if is_quoted(explanation.numbers) else {}


SHIFTS_PART = Part(
    title="Robustness",
    label="Robustness",
    needs=("shifts",),
    text={"shifts": QUOTED},
    draw=_draw_shifts,
    tables=_shifts_tables,
    extras=lambda explanation: {"rows": _shifts_tables(explanation).get("shifts", [])},
)
LEFT_OUT_PART = Part(
    title="What is left out, and why",
    label="Left out",
    needs=("left_out",),
    text={"left_out": LEFT_OUT},
)
