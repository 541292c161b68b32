"""Alike frames that are answered in opposite ways, side by side (Fig. 9), and loops."""

from PIL import Image

from drone_rl.evaluation.plots import images as pictures
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.text import CONTRADICTIONS, LOOPS

KINDS = ("contradiction", "justified", "unknown")
MOST_PAIRS = 4
"""Of each kind that are shown."""


def draw(explanation: Explanation) -> dict[str, Image.Image]:
    """A picture of each kind of pair of which there is one."""
    drawn = {kind: pairs(explanation, kind) for kind in KINDS}
    return {f"pairs_{kind}": picture for kind, picture in drawn.items() if picture is not None}


def pairs(explanation: Explanation, kind: str) -> Image.Image | None:
    """The worst pairs of a kind; None if there is none."""
    listed = explanation.numbers["contradictions"]["list"]
    shown = [pair for pair in listed if pair["kind"] == kind][:MOST_PAIRS]
    if not shown:
        return None
    tiles = [
        pictures.probed_frame(
            explanation.data, pair[side], f"frame {pair[side]}: more {side}", explanation.actions
        )
        for pair in shown
        for side in ("left", "right")
    ]
    return pictures.gridded(tiles, 2)


PART = Part(
    title="Contradictions and loops",
    label="Contradictions and loops",
    place=40,
    needs=("contradictions", "loops"),
    words={"contradictions": CONTRADICTIONS, "loops": LOOPS},
    draw=draw,
)
