"""Report section "class_model": observations optimized for each action (Figs. 10 to 12)."""

from typing import Any

from PIL import Image

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.results import ClassModel, Explanation
from drone_rl.trust.plots import images


def tiles(model: ClassModel, explanation: Explanation) -> dict[str, dict[str, Image.Image]]:
    """Return the images by caption, those by probability first."""
    by_caption: dict[str, Image.Image] = {}
    limits, actions = (model.statistics.low, model.statistics.high), explanation.actions
    for objective, best in (("probability", model.probability), ("logit", model.logit)):
        for action in actions.order:
            image = images.shown_picture(best.images[action], *limits, model.channels)
            reached = f"{actions.names[action]} {best.probabilities[action]:.3f}"
            caption = f"{reached} (by {objective})"
            by_caption[caption] = images.titled(images.enlarge(image), caption)
    return {"class_model": by_caption}


def unreached(model: ClassModel, explanation: Explanation) -> dict[str, Any]:
    """Return the actions that no image made probable."""
    highest = zip(model.probability.highest, model.logit.highest, strict=True)
    names = zip(explanation.actions.names, highest, strict=True)
    return {"unreached": [name for name, most in names if max(most) <= 0.5]}


PART = Part(
    title="Observations that maximize each action (class models)",
    label="Class models",
    draw=tiles,
    values=unreached,
)
