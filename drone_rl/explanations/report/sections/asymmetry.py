"""Left and right: the frames on which the policy and its mirror image differ most."""

from PIL import Image

from drone_rl.evaluation.plots import images as pictures
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.response_text import ASYMMETRY


def worst_frames(explanation: Explanation) -> Image.Image:
    """Three of them, with the action probabilities."""
    worst = explanation.numbers["asymmetry"]["dataset"]["worst"][:3]
    tiles = [
        pictures.probed_frame(
            explanation.data,
            entry["frame"],
            f"differs by {entry['distance']:.2f}",
            explanation.actions,
        )
        for entry in worst
    ]
    return pictures.gridded(tiles, 3)


PART = Part(
    title="Left and right",
    label="Left and right",
    place=90,
    needs=("asymmetry",),
    words={"asymmetry": ASYMMETRY},
    draw=lambda explanation: {"asymmetry": worst_frames(explanation)},
)
