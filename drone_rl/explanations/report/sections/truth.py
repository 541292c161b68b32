"""Are the heat maps true? Tests, curves, where the heat lies, and what changes to a scene do."""

from PIL import Image

from drone_rl.evaluation.plots import images as pictures
from drone_rl.explanations.report.curves import curves_chart
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Drawn, Part
from drone_rl.explanations.report.trials import heat_chart, truth_chart
from drone_rl.explanations.report.truth_text import FINDINGS, REASONS


def draw(explanation: Explanation) -> Drawn:
    """Every figure of the tests."""
    return {
        "truth": truth_chart(explanation),
        "curves": curves_chart(explanation),
        "heat": heat_chart(explanation),
        "interventions": changes(explanation),
    }


def changes(explanation: Explanation) -> Image.Image:
    """One frame and what each change to the scene made of it."""
    truth = explanation.numbers["truth"]
    before = explanation.data["frames"][truth["shown_frame"]]
    tiles = [pictures.titled(pictures.enlarge(before), "as it was")]
    after = explanation.arrays["interventions"]
    for (name, effect), frame in zip(truth["interventions"].items(), after, strict=True):
        size = "not tried"
        if effect["mean"] is not None:
            size = f"{effect['mean']:.2f} [{effect['lower95']:.2f}, {effect['upper95']:.2f}]"
        tiles.append(pictures.titled(pictures.enlarge(frame), f"{name}: {size}"))
    return pictures.gridded(tiles, 3)


PART = Part(
    title="Is the picture true?",
    label="Is the picture true?",
    place=70,
    needs=("truth",),
    words={"truth": FINDINGS, "reasons": REASONS},
    draw=draw,
)
