"""Report section "class_model": observations optimized for each action (Figs. 10 to 12)."""

from collections.abc import Sequence
from typing import Any

from PIL import Image

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.results import ClassModel, Explanation
from drone_rl.sim.vocabulary import ShownActions
from drone_rl.trust.plots import images


def tiles(model: ClassModel, actions: ShownActions, start: str = "") -> dict[str, Image.Image]:
    """Return the images of one policy by caption, each with a start."""
    by_caption: dict[str, Image.Image] = {}
    limits = model.statistics.low, model.statistics.high
    for objective, best in (("probability", model.probability), ("logit", model.logit)):
        for action in actions.order:
            image = images.shown_picture(best.images[action], *limits, model.channels)
            reached = f"{actions.names[action]} {best.probabilities[action]:.3f}"
            caption = f"{start}{reached} (by {objective})"
            by_caption[caption] = images.titled(images.enlarge(image), caption)
    return by_caption


def compare(explanations: Sequence[Explanation]) -> dict[str, Image.Image]:
    """Draw images by policy and objective (rows) and action (columns), with probabilities."""
    grids = []
    for explanation in explanations:
        model, actions = explanation.class_model, explanation.actions
        assert model is not None
        start = f"{explanation.name[:18]}: " if len(explanations) > 1 else ""
        row = [*tiles(model, actions, start).values()]
        grids.append(images.gridded(row, len(actions.names)))
    return {"class_models": images.stacked(grids, gap=12)}


def unreached(model: ClassModel, explanation: Explanation) -> dict[str, Any]:
    """Return the actions that no image made probable."""
    highest = zip(model.probability.highest, model.logit.highest, strict=True)
    names = zip(explanation.actions.names, highest, strict=True)
    return {"unreached": [name for name, most in names if max(most) <= 0.5]}


PART = Part(
    title="Observations that maximize each action (class models)",
    label="Class models",
    draw=lambda model, explanation: {"class_model": tiles(model, explanation.actions)},
    values=unreached,
    compare=compare,
)
