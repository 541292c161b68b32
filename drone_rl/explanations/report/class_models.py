"""Report section "class_model": observations optimized for each action (Figs. 10 to 12)."""

from collections.abc import Sequence
from typing import Any

from PIL import Image

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.results import BestModels, Explanation
from drone_rl.trust.plots import images


def objectives(explanation: Explanation) -> dict[str, BestModels]:
    """Return the class models by objective."""
    model = explanation.class_model
    return {"probability": model.probability, "logit": model.logit} if model else {}


def tiles(explanation: Explanation, start: str = "") -> dict[str, Image.Image]:
    """Return the images of one policy by caption, each with a start."""
    by_caption: dict[str, Image.Image] = {}
    model, actions = explanation.class_model, explanation.actions
    assert model is not None
    limits = model.statistics.low, model.statistics.high
    for objective, best in objectives(explanation).items():
        for action in actions.order:
            image = images.shown_picture(best.images[action], *limits, model.channels)
            reached = f"{actions.names[action]} {best.probabilities[action]:.3f}"
            caption = f"{start}{reached} (by {objective})"
            by_caption[caption] = images.titled(images.enlarge(image), caption)
    return by_caption


def grid(explanations: Sequence[Explanation]) -> Image.Image:
    """Return images by policy and objective (rows) and action (columns), with probabilities."""
    grids = []
    for explanation in explanations:
        start = f"{explanation.name[:18]}: " if len(explanations) > 1 else ""
        row = [*tiles(explanation, start).values()]
        grids.append(images.gridded(row, len(explanation.actions.names)))
    return images.stacked(grids, gap=12)


def values(explanation: Explanation) -> dict[str, Any]:
    """Return the actions that no image made probable, and a table of the settings tried."""
    names, models = explanation.actions.names, objectives(explanation)
    highest = zip(*(best.highest for best in models.values()), strict=True)
    rows = [["objective", "parameters", "blur", "steps", *names, "roughness", ""]]
    for objective, best in models.items():
        for one in best.tried:
            of = one.settings
            row = [objective, of["parameterisation"], f"{of['blur']}", f"{of['steps']}"]
            row += [f"{p:.3f}" for p in one.probabilities]
            rough = " ".join(f"{r:.2f}" for r in one.roughness)
            rows.append([*row, rough, "shown" if one.shown else ""])
    unreached = [name for name, most in zip(names, highest, strict=True) if max(most) <= 0.5]
    return {"unreached": unreached, "rows": rows}


PART = Part(
    title="Observations that maximize each action (class models)",
    label="Class models",
    draw=lambda explanation: {"class_model": tiles(explanation)},
    values=values,
    compare=lambda explanations: {"class_models": grid(explanations)},
)
