"""Report sections: verdict, robustness, what is left out, rollouts, flaws."""

from PIL import Image

from drone_rl.explanations.report.explanation import METHOD_NAMES, Explanation, Figures, Part
from drone_rl.sim.vocabulary import shown_actions, terms_of
from drone_rl.trust import charts
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import Rows
from drone_rl.trust.quoted_text import QUOTED, is_quoted, not_evaluated
from drone_rl.trust.shifts_text import rows
from drone_rl.trust.verdict_text import SENTENCES, depends_on_rounding
from drone_rl.utils.schema import as_mapping
from drone_rl.utils.text import (
    Claims,
    Evidence,
    among,
    bounds,
    is_fixed,
    listed,
    percent,
    plural,
    said,
    seed_line,
    seed_of,
)


def say_source(evidence: Evidence) -> Claims:
    """Say which file the page repeats; "source" is its name."""
    revision = as_mapping(evidence.get("provenance", {}), "provenance").get("git_revision")
    return {
        "source.file": (
            f"This page repeats what {evidence['source']} says (written "
            f"{evidence.get('date') or 'on an unknown date'}, revision {revision or 'unknown'}). "
            "The figures were read from this file and not measured again."
        )
    }


def say_verdict(evidence: Evidence) -> Claims:
    """Say the verdict by its figures; the sentence in the file may say anything."""
    return said(SENTENCES, evidence["verdict"])


def say_advice(evidence: Evidence) -> Claims:
    """Say what to do about the verdict."""
    verdict = evidence["verdict"]
    if verdict["certain"] and verdict["kind"] == "good":
        return {
            "advice.use": (
                "What to do: rely on it in environments like those tested, and in no others."
            )
        }
    if verdict["certain"]:
        return {
            "advice.refuse": (
                "What to do: do not rely on it; drone-rl verdict with require=good ends with exit "
                f"status {verdict['exit_code']}."
            )
        }
    if depends_on_rounding(verdict):
        more = "do not rely on it; more episodes do not change that."
    elif (enough := verdict["enough"]) is None:
        more = "evaluate many more episodes, or do not rely on it; this may stay open."
    else:
        more = f"evaluate more episodes (episodes={enough}) before relying on it."
    return {"advice.more": f"What to do: {more}"}


def say_scope(evidence: Evidence) -> Claims:
    """Say with which colors, light or sizes the policy was not evaluated."""
    if not (names := not_evaluated(evidence)):
        return {}
    start = "The verdict holds for" if is_quoted(evidence) else "Tested in"
    return {
        "scope.one_look": (
            f"{start} the appearance and light of these episodes only: nothing here tests other "
            f"{listed(names, 'or')}."
        )
    }


def say_seed(evidence: Evidence) -> Claims:
    """Warn of a seed that was known before the analysis."""
    if not is_fixed(evidence):
        return {}
    return {
        "explanation.fixed_seed": (
            f"Fixed seed {seed_of(evidence)}: a policy could have been fitted to the environments, "
            "frames and placements of all sections."
        )
    }


def say_left_out(evidence: Evidence) -> Claims:
    """Say why sections could not be computed for this policy."""
    reasons = evidence.get("left_out")
    return {"left_out.why": " ".join(reasons.values())} if reasons else {}


def _evaluation_extras(explanation: Explanation) -> dict[str, str]:
    truth = explanation.numbers.get("truth")
    trusted = METHOD_NAMES.get(truth["trusted"], "none") if truth else "none was tested"
    return {"trusted": trusted, "seed": seed_line(explanation.numbers)}


EVALUATION_PART = Part(
    title="Verdict",
    label="Verdict",
    needs=("verdict",),
    text={"verdict": say_verdict, "advice": say_advice, "scope": say_scope, "seed": say_seed},
    extras=_evaluation_extras,
)


def _draw_shifts(explanation: Explanation) -> Figures:
    """Draw curves and rows of frames, unless the measurement is refused."""
    numbers = explanation.numbers["shifts"]
    if not is_quoted(explanation.numbers):
        return {}
    frames = {
        f"conditions_{name}": charts.conditions(
            numbers, name, [*explanation.arrays[f"shifts_{name}"]]
        )
        for name in numbers["axes"]
    }
    return {"shifts": charts.curves(numbers), **frames}


def _shifts_tables(explanation: Explanation) -> dict[str, Rows]:
    return {"shifts": rows(explanation.numbers["shifts"])} if is_quoted(explanation.numbers) else {}


SHIFTS_PART = Part(
    title="Robustness",
    label="Robustness",
    needs=("shifts",),
    text={"shifts": QUOTED},
    draw=_draw_shifts,
    tables=_shifts_tables,
    extras=lambda explanation: {
        "rows": _shifts_tables(explanation).get("shifts", []),
        "names": charts.NAMES,
    },
)
LEFT_OUT_PART = Part(
    title="What is left out, and why",
    label="Left out",
    needs=("left_out",),
    text={"left_out": say_left_out},
)


KINDS = ("contradiction", "justified", "unknown")
MAX_PAIRS = 4  # pairs of each kind that are shown


def say_dataset(evidence: Evidence) -> Claims:
    """Say what was recorded, and which actions the policy took."""
    found, terms, claims = evidence["dataset"], terms_of(evidence), Claims()
    shares = dict(zip(shown_actions(evidence).names, found["action_shares"], strict=True))
    if found["frames"] > 0:
        claims["dataset.size"] = (
            f"{found['frames']} frames, spread evenly over {found['episodes']} whole episodes of "
            f"{found['steps']:,} steps with sampled actions."
        )
    if max(shares.values()) < 1:
        parts = listed([f"{percent(share)} {name}" for name, share in shares.items()])
        claims["dataset.actions"] = f"Actions taken: {parts}."
    if max(shares.values()) == 1:
        only = next(name for name, share in shares.items() if share == 1)
        claims["dataset.one_action"] = f"Every step took the same action, {only}."
    if found["entropy"]["mean"] is not None:
        claims["dataset.entropy"] = (
            f"The policy's mean entropy is {found['entropy']['mean']:.2f}, where 0 is "
            f"deterministic and 1 is uniform ({bounds(found['entropy'])})."
        )
    if found["goals_reached"] == 0:
        claims["dataset.none_reached"] = f"No {terms.goal} was {terms.reached} in these episodes."
    return claims


def say_contradictions(evidence: Evidence) -> Claims:
    """Say how many similar frames get opposite actions, and whether that is justified."""
    found, target, claims = evidence["contradictions"], terms_of(evidence).target, Claims()
    if found["pairs"] == 0:
        claims["contradictions.none"] = (
            f"Among these {found['frames']} frames, no two similar ones get opposite actions."
        )
    if found["pairs"] > 0:
        unknown = found["unknown"]
        last = f", {unknown} unknown (a frame has no next {target})." if unknown else "."
        claims["contradictions.pairs"] = (
            f"Among these {found['frames']} frames, {plural(found['pairs'], 'pair')} of similar "
            f"ones {'gets' if found['pairs'] == 1 else 'get'} opposite actions (each frame is in "
            f"one pair at most): {plural(found['contradictions'], 'contradiction')} (the next "
            f"{target} is at about the same place in both), {found['justified']} justified (it is "
            f"elsewhere){last}"
        )
    if found["contradictions"] > 0:
        claims["contradictions.worst"] = (
            "In the worst contradiction, from one frame to the other, left loses and right gains "
            f"at least {found['worst_opposition']:.2f} of probability."
        )
    return claims


def say_loops(evidence: Evidence) -> Claims:
    """Say in how many episodes the drone moves back and forth."""
    found, share = evidence["loops"], evidence["loops"]["episodes"]
    if found["loops"] > 0:
        return {
            "loops.some": (
                f"In {among(share)} of these sampled episodes the drone moves back and forth in a "
                f"loop ({bounds(share, percent)}); the longest loop has {found['longest']} "
                f"steps, and all loops together have {percent(found['frames_share'])} of "
                "the steps."
            )
        }
    return {
        "loops.none": (
            f"None of these {share['trials']} sampled episodes has a loop, in which the drone "
            f"moves back and forth; up to {percent(share['upper95'])} of such episodes may "
            "have one (95%)."
        )
    }


def pairs(explanation: Explanation, kind: str) -> dict[str, Image.Image]:
    """Return images of the worst pairs of a kind, left and right in turn, by caption."""
    found = explanation.numbers["contradictions"]["list"]
    shown = [pair for pair in found if pair["kind"] == kind][:MAX_PAIRS]
    return {
        f"pair {i}, frame {pair[side]}: more {side}": images.frame_with_probabilities(
            explanation.data, pair[side], f"frame {pair[side]}: more {side}", explanation.actions
        )
        for i, pair in enumerate(shown, start=1)
        for side in ("left", "right")
    }


DATASET_PART = Part(
    title="Recorded rollouts", label="Rollouts", needs=("dataset",), text={"dataset": say_dataset}
)
FLAWS_PART = Part(
    title="Contradictions and loops",
    label="Contradictions and loops",
    needs=("contradictions", "loops"),
    text={"contradictions": say_contradictions, "loops": say_loops},
    draw=lambda explanation: {
        f"pairs_{kind}": shown for kind in KINDS if (shown := pairs(explanation, kind))
    },
)
