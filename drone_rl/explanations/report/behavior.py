"""Report sections: verdict, robustness, what is left out, rollouts, flaws."""

from PIL import Image

from drone_rl.explanations.report.explanation import Explanation, Figures, Part
from drone_rl.sim.vocabulary import shown_actions, terms_of
from drone_rl.trust import charts
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.plots import images
from drone_rl.trust.results import Verdict
from drone_rl.trust.shifts_results import Robustness, SavedShifts, not_evaluated
from drone_rl.utils.text import (
    Claims,
    Evidence,
    among,
    bounds,
    is_fixed,
    listed,
    percent,
    seed_line,
)


def say_source(evidence: Evidence) -> Claims:
    """Say which file the page repeats; "source" is its name."""
    revision = evidence.get("provenance", {}).get("git_revision") or "unknown"
    return {
        "source.file": (
            f"This page repeats what {evidence['source']} says (written {evidence['date']}, "
            f"revision {revision}). The figures were read from this file and not measured again."
        )
    }


def say_verdict(evidence: Evidence) -> Claims:
    """Say the verdict by its figures; the sentence in the file may say anything."""
    return {"verdict": Verdict.read(evidence["verdict"]).sentence}


def say_advice(evidence: Evidence) -> Claims:
    """Say what to do about the verdict."""
    verdict = evidence["verdict"]
    if not verdict["certain"]:
        more = "do not rely on it; more episodes do not change that."
        if not Verdict.read(verdict).is_open_by_rounding:
            count = verdict["enough"]
            episodes = f"more episodes (episodes={count})" if count else "many more episodes"
            more = f"evaluate {episodes} before relying on it."
        return {"advice.more": f"What to do: {more}"}
    if verdict["kind"] == "good":
        text = "rely on it in environments like those tested, and in no others."
        return {"advice.use": f"What to do: {text}"}
    return {
        "advice.refuse": (
            "What to do: do not rely on it; drone-rl verdict with require=good ends with exit "
            f"status {verdict['exit_code']}."
        )
    }


def say_scope(evidence: Evidence) -> Claims:
    """Say with which colors, light or sizes the policy was not evaluated."""
    if not (names := not_evaluated(quoted_shifts(evidence))):
        return {}
    return {
        "scope.appearance": (
            "The verdict holds for the appearance and light of these episodes only: nothing here "
            f"tests other {listed(names, 'or')}."
        )
    }


def say_seed(evidence: Evidence) -> Claims:
    """Warn of a seed that was known before the analysis."""
    if not is_fixed(evidence):
        return {}
    return {
        "explanation.fixed_seed": (
            f"Fixed seed {evidence.get('seed')}: a policy could have been fitted to the "
            "environments, frames and placements of all sections."
        )
    }


def quoted_shifts(evidence: Evidence) -> Robustness | None:
    """Return the robustness evaluation, unless there is none or it is refused."""
    if not evidence.get("shifts"):
        return None
    measured = SavedShifts.read(evidence["shifts"])
    return None if measured.why_not(Verdict.read(evidence["verdict"])) else measured.shifts


def say_shifts(evidence: Evidence) -> Claims:
    """Say the operating domain, or why it is not shown."""
    if not evidence.get("shifts"):
        return {}
    measured = SavedShifts.read(evidence["shifts"])
    return {"domain": measured.text(Verdict.read(evidence["verdict"]))}


def say_left_out(evidence: Evidence) -> Claims:
    """Say why sections could not be computed for this policy."""
    return {"left_out.why": " ".join(evidence["left_out"].values())}


EVALUATION_PART = Part(
    title="Verdict",
    label="Verdict",
    needs=("verdict",),
    text={"verdict": say_verdict, "advice": say_advice, "scope": say_scope, "seed": say_seed},
    extras=lambda explanation: {"seed": seed_line(explanation.numbers)},
)


def draw_shifts(explanation: Explanation) -> Figures:
    """Draw curves and rows of frames, unless the measurement is refused."""
    if (shifts := quoted_shifts(explanation.numbers)) is None:
        return {}
    frames = {
        f"conditions_{name}": charts.conditions(
            shifts, name, [*explanation.arrays[f"shifts_{name}"]]
        )
        for name in shifts.axes
    }
    return {"shifts": charts.curves(shifts), **frames}


SHIFTS_PART = Part(
    title="Robustness",
    label="Robustness",
    needs=("shifts",),
    text={"shifts": say_shifts},
    draw=draw_shifts,
    extras=lambda explanation: {
        "rows": shifts.table() if (shifts := quoted_shifts(explanation.numbers)) else [],
        "names": NAMES,
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
    data, terms = evidence["dataset"], terms_of(evidence)
    shares = zip(shown_actions(evidence).names, data["action_shares"], strict=True)
    entropy = data["entropy"]
    return {
        "dataset.size": (
            f"{data['frames']} frames, spread evenly over {data['episodes']} whole episodes of "
            f"{data['steps']:,} steps with sampled actions; {data['goals_reached']} {terms.goals} "
            f"{terms.reached}."
        ),
        "dataset.actions": (
            f"Actions taken: {listed([f'{percent(share)} {name}' for name, share in shares])}."
        ),
        "dataset.entropy": (
            f"The policy's mean entropy is {entropy['mean']:.2f}, where 0 is deterministic and 1 "
            f"is uniform ({bounds(entropy)})."
        ),
    }


def say_contradictions(evidence: Evidence) -> Claims:
    """Say how many similar frames get opposite actions, and whether that is justified."""
    flaws, target = evidence["contradictions"], terms_of(evidence).target
    claims = {
        "contradictions.pairs": (
            f"Pairs of similar frames with opposite actions among these {flaws['frames']} frames, "
            f"each in one pair at most: {flaws['contradictions']} contradictions (the next "
            f"{target} is at about the same place in both), {flaws['justified']} justified (it is "
            f"elsewhere), {flaws['unknown']} unknown (a frame has no next {target})."
        )
    }
    if flaws["contradictions"] > 0:
        claims["contradictions.worst"] = (
            "In the worst contradiction, from one frame to the other, left loses and right gains "
            f"at least {flaws['worst_opposition']:.2f} of probability."
        )
    return claims


def say_loops(evidence: Evidence) -> Claims:
    """Say in how many episodes the drone moves back and forth."""
    loops, share = evidence["loops"], evidence["loops"]["episodes"]
    return {
        "loops.share": (
            f"In {among(share)} of these sampled episodes the drone moves back and forth in a loop "
            f"({bounds(share, percent)}); all loops together have {percent(loops['frames_share'])} "
            f"of the steps, the longest {loops['longest']} steps."
        )
    }


def pairs(explanation: Explanation, kind: str) -> dict[str, Image.Image]:
    """Return images of the worst pairs of a kind, left and right in turn, by caption."""
    listed_pairs = explanation.numbers["contradictions"]["list"]
    worst = [pair for pair in listed_pairs if pair["kind"] == kind][:MAX_PAIRS]
    return {
        f"pair {i}, frame {pair[side]}: more {side}": images.frame_with_probabilities(
            explanation.data, pair[side], f"frame {pair[side]}: more {side}", explanation.actions
        )
        for i, pair in enumerate(worst, start=1)
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
        f"pairs_{kind}": tiles for kind in KINDS if (tiles := pairs(explanation, kind))
    },
)
