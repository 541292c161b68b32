"""The picture that each action is waiting for (Figs. 10 to 12)."""

from collections.abc import Sequence

from PIL import Image

from drone_rl.evaluation.plots import images as pictures
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.text import CLASS_MODEL


def grid(explanations: Sequence[Explanation]) -> Image.Image:
    """Actions across, policies and objectives down, the probability reached over each picture."""
    tiles = []
    for explanation in explanations:
        who = f"{explanation.name[:18]}: " if len(explanations) > 1 else ""
        statistics = explanation.numbers["class_model"]["statistics"]
        low, high = statistics["low"], statistics["high"]
        told = explanation.numbers["class_model"]
        channels = told.get("channels", "rgb" if told.get("color") else "gray")  # as once written
        for objective in ("probability", "logit"):
            reached = explanation.numbers["class_model"][objective]["probabilities"]
            shown = explanation.arrays[f"class_model_{objective}"]
            for action in explanation.actions.order:
                picture = pictures.shown_picture(shown[action], low, high, channels)
                name = explanation.actions.names[action]
                caption = f"{who}{name} {reached[action]:.3f} (by {objective})"
                tiles.append(pictures.titled(pictures.enlarge(picture), caption))
    return pictures.gridded(tiles, len(explanations[0].actions.names))


PART = Part(
    title="The picture that each action is waiting for (class models)",
    label="Class models",
    place=50,
    needs=("class_model",),
    words={"class_model": CLASS_MODEL},
    draw=lambda explanation: {"class_model": grid([explanation])},
    compare=lambda explanations: {"class_models": grid(explanations)},
)
