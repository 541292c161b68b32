"""Report sections: verdict, robustness, what is left out, rollouts, flaws."""

from typing import Any

from PIL import Image

from drone_rl.explanations.report.part import Figures, Part
from drone_rl.explanations.results import Explanation, Flaws
from drone_rl.trust import charts
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.plots import images
from drone_rl.trust.shifts_results import SavedShifts

MAX_PAIRS = 4  # pairs of each kind that are shown


def draw_shifts(saved: SavedShifts, explanation: Explanation) -> Figures:
    """Draw curves and rows of frames, unless the measurement is refused."""
    if (shifts := explanation.robustness) is None:
        return {}
    frames = {
        f"conditions_{n}": charts.conditions(shifts, n, shifts.frames(n)) for n in shifts.axes
    }
    return {"shifts": charts.curves(shifts), **frames}


def describe_shifts(saved: SavedShifts, explanation: Explanation) -> dict[str, Any]:
    """Return the robustness in words, and as a table."""
    shifts, verdict = explanation.robustness, explanation.verdict
    return {
        "texts": [
            saved.finding(verdict).text if verdict else "",
            shifts.sentence if shifts else "",
        ],
        "rows": shifts.table() if shifts else [],
        "names": NAMES,
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


VERDICT_PART = Part(title="Verdict", label="Verdict")
SHIFTS_PART = Part(title="Robustness", label="Robustness", draw=draw_shifts, values=describe_shifts)
LEFT_OUT_PART = Part(title="What is left out, and why", label="Left out")
DATASET_PART = Part(title="Recorded rollouts", label="Rollouts")
FLAWS_PART = Part(
    title="Contradictions and loops", label="Contradictions and loops", draw=draw_pairs
)
