"""Report sections: verdict, robustness, what is left out, rollouts, flaws."""

from collections.abc import Mapping
from typing import Any

from PIL import Image

from drone_rl.explanations.report.part import Figures, Part
from drone_rl.explanations.results import Explanation, Flaws, QuotedShifts
from drone_rl.trust import charts, shifts_text
from drone_rl.trust.plots import images
from drone_rl.trust.verdict_text import SENTENCES, depends_on_rounding
from drone_rl.utils.text import say, seed_line

MAX_PAIRS = 4  # pairs of each kind that are shown


def evidence(explanation: Explanation) -> dict[str, Any]:
    """Return verdict and robustness for the sentences of `drone_rl.trust`."""
    quoted = explanation.shifts
    header = {"seed": explanation.seed, "seed_is_fixed": explanation.seed_is_fixed}
    measured = {"shifts": quoted.measured} if quoted else {}
    return {"verdict": explanation.verdict, **measured, **header}


def describe_verdict(verdict: Mapping[str, Any], explanation: Explanation) -> dict[str, Any]:
    """Return the verdict in words."""
    return {
        "text": say(SENTENCES, verdict),
        "depends_on_rounding": depends_on_rounding(verdict),
        "untested": shifts_text.not_evaluated(evidence(explanation)),
        "seed": seed_line(evidence(explanation)),
    }


def is_quoted(explanation: Explanation) -> bool:
    """Return whether the robustness is shown."""
    return shifts_text.is_quoted(evidence(explanation))


def why_not_quoted(explanation: Explanation) -> str | None:
    """Return the reason why the robustness is not shown, or None."""
    return shifts_text.why_not(evidence(explanation))


def robust_axes(explanation: Explanation) -> list[str]:
    """Return the axes with a range in which the policy is good."""
    measured = explanation.shifts.measured if explanation.shifts else {}
    return [shifts_text.NAMES[name] for name in shifts_text.wide(measured)]


def draw_shifts(quoted: QuotedShifts, explanation: Explanation) -> Figures:
    """Draw curves and rows of frames, unless the measurement is refused."""
    if not is_quoted(explanation):
        return {}
    frames = {
        f"conditions_{name}": charts.conditions(quoted.measured, name, [*strip])
        for name, strip in quoted.frames.items()
    }
    return {"shifts": charts.curves(quoted.measured), **frames}


def describe_shifts(quoted: QuotedShifts, explanation: Explanation) -> dict[str, Any]:
    """Return the robustness in words, and as a table."""
    return {
        "text": say(shifts_text.QUOTED, evidence(explanation)),
        "rows": shifts_text.rows(quoted.measured) if is_quoted(explanation) else [],
        "names": charts.NAMES,
    }


def draw_pairs(flaws: Flaws, explanation: Explanation) -> dict[str, dict[str, Image.Image]]:
    """Draw the worst pairs of each kind, left and right in turn, by caption."""
    drawn: dict[str, dict[str, Image.Image]] = {}
    for pair in flaws.pairs:
        tiles = drawn.setdefault(f"pairs_{pair.kind}", {})
        number = len(tiles) // 2 + 1
        for side, frame in (("left", pair.left), ("right", pair.right)):
            caption = f"frame {frame}: more {side}"
            if number <= MAX_PAIRS:
                tiles[f"pair {number}, {caption}"] = images.frame_with_probabilities(
                    explanation.data, frame, caption, explanation.actions
                )
    return drawn


VERDICT_PART = Part(title="Verdict", label="Verdict", values=describe_verdict)
SHIFTS_PART = Part(title="Robustness", label="Robustness", draw=draw_shifts, values=describe_shifts)
LEFT_OUT_PART = Part(title="What is left out, and why", label="Left out")
DATASET_PART = Part(title="Recorded rollouts", label="Rollouts")
FLAWS_PART = Part(
    title="Contradictions and loops", label="Contradictions and loops", draw=draw_pairs
)
