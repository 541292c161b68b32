"""Report sections "evaluation" and "shifts" (the verdict, robustness), "dataset", and "flaws".

Evidence of all sentences: `explanation.json`; of `SOURCE` also "source", the name of that file.
"""

from PIL import Image

from drone_rl.evaluation.plots import images
from drone_rl.evaluation.plots.saving import Rows
from drone_rl.evaluation.verdict_text import depends_on_rounding
from drone_rl.explanations.report.explanation import Drawn, Explanation, Part
from drone_rl.explanations.report.validation import METHOD_NAMES
from drone_rl.robustness import charts
from drone_rl.robustness.shifts_text import QUOTED, is_quoted, rows, untested
from drone_rl.sim.vocabulary import shown_actions, terms_of
from drone_rl.utils.schema import as_mapping
from drone_rl.utils.text import (
    Evidence,
    Sentence,
    among,
    bounds,
    is_fixed,
    listed,
    percent,
    plural,
    seed_line,
    seed_of,
)

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


KINDS = ("contradiction", "justified", "unknown")
MOST_PAIRS = 4
"""Pairs of each kind that are shown."""


def _shares(evidence: Evidence) -> dict[str, float]:
    """Return the fraction of the steps by name of the action."""
    shares, names = evidence["dataset"]["action_shares"], shown_actions(evidence).names
    return dict(zip(names, shares, strict=True))


DATASET = (
    Sentence(
        "dataset.size",
        "frames were recorded",
        lambda e: e["dataset"]["frames"] > 0,
        lambda e: (
            f"{e['dataset']['frames']} frames, spread evenly over {e['dataset']['episodes']} whole "
            f"episodes of {e['dataset']['steps']:,} steps with sampled actions."
        ),
    ),
    Sentence(
        "dataset.actions",
        "more than one action was taken",
        lambda e: max(e["dataset"]["action_shares"]) < 1,
        lambda e: (
            f"Actions taken: {listed([f'{percent(s)} {name}' for name, s in _shares(e).items()])}."
        ),
    ),
    Sentence(
        "dataset.one_action",
        "every step took the same action",
        lambda e: max(e["dataset"]["action_shares"]) == 1,
        lambda e: (
            "Every step took the same action, "
            f"{next(name for name, s in _shares(e).items() if s == 1)}."
        ),
    ),
    Sentence(
        "dataset.entropy",
        "the policy's probabilities were recorded",
        lambda e: e["dataset"]["entropy"]["mean"] is not None,
        lambda e: (
            f"The policy's mean entropy is {e['dataset']['entropy']['mean']:.2f}, where 0 is "
            f"deterministic and 1 is uniform ({bounds(e['dataset']['entropy'])})."
        ),
    ),
    Sentence(
        "dataset.none_reached",
        "no step reached a goal",
        lambda e: e["dataset"]["goals_reached"] == 0,
        lambda e: f"No {terms_of(e).goal} was {terms_of(e).reached} in these episodes.",
    ),
)


def _pairs(evidence: Evidence) -> str:
    found, target = evidence["contradictions"], terms_of(evidence).target
    verb = "gets" if found["pairs"] == 1 else "get"
    unknown = found["unknown"]
    last = f", {unknown} unknown (a frame has no next {target})." if unknown else "."
    return (
        f"Among these {found['frames']} frames, {plural(found['pairs'], 'pair')} of similar ones "
        f"{verb} opposite actions (each frame is in one pair at most): "
        f"{plural(found['contradictions'], 'contradiction')} (the next {target} is at about the "
        f"same place in both), {found['justified']} justified (it is elsewhere){last}"
    )


CONTRADICTIONS = (
    Sentence(
        "contradictions.none",
        "no pair was found among the analysed frames",
        lambda e: e["contradictions"]["pairs"] == 0,
        lambda e: (
            f"Among these {e['contradictions']['frames']} frames, no two similar ones get "
            "opposite actions."
        ),
    ),
    Sentence(
        "contradictions.pairs",
        "pairs were found; all are counted",
        lambda e: e["contradictions"]["pairs"] > 0,
        _pairs,
    ),
    Sentence(
        "contradictions.worst",
        "one of the pairs is a contradiction",
        lambda e: e["contradictions"]["contradictions"] > 0,
        lambda e: (
            "In the worst contradiction, the probability of a turn changes sides by "
            f"{e['contradictions']['worst_opposition']:.2f}."
        ),
    ),
)


def _loops(evidence: Evidence) -> str:
    found = evidence["loops"]
    share = found["episodes"]
    return (
        f"In {among(share)} of these sampled episodes the drone moves back and forth in a loop "
        f"({bounds(share, percent)}); the longest loop has {found['longest']} steps, and all loops "
        f"together have {percent(found['frames_share'])} of the steps."
    )


LOOPS = (
    Sentence(
        "loops.none",
        "no episode has a loop",
        lambda e: not e["loops"]["loops"],
        lambda e: (
            f"None of these {e['loops']['episodes']['trials']} sampled episodes has a loop, in "
            "which the drone moves back and forth; up to "
            f"{percent(e['loops']['episodes']['upper95'])} of such episodes may have one (95%)."
        ),
    ),
    Sentence("loops.some", "episodes have loops", lambda e: e["loops"]["loops"] > 0, _loops),
)


def pairs(explanation: Explanation, kind: str) -> Image.Image | None:
    """Return an image of the worst pairs of a kind; None if there is none."""
    listed = explanation.numbers["contradictions"]["list"]
    shown = [pair for pair in listed if pair["kind"] == kind][:MOST_PAIRS]
    if not shown:
        return None
    tiles = [
        images.probed_frame(
            explanation.data, pair[side], f"frame {pair[side]}: more {side}", explanation.actions
        )
        for pair in shown
        for side in ("left", "right")
    ]
    return images.gridded(tiles, 2)


DATASET_PART = Part(
    title="Recorded rollouts", label="Rollouts", needs=("dataset",), text={"dataset": DATASET}
)
FLAWS_PART = Part(
    title="Contradictions and loops",
    label="Contradictions and loops",
    needs=("contradictions", "loops"),
    text={"contradictions": CONTRADICTIONS, "loops": LOOPS},
    draw=lambda explanation: {
        f"pairs_{kind}": image for kind in KINDS if (image := pairs(explanation, kind)) is not None
    },
)
