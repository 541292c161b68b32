"""Report section "class_models": observations optimized for each action (Figs. 10 to 12)."""

from collections.abc import Sequence

from PIL import Image

from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.sim.vocabulary import shown_actions
from drone_rl.trust.plots import images
from drone_rl.utils.text import Claims, Evidence, listed

_OBJECTIVES = ("probability", "logit")


def say_class_models(evidence: Evidence) -> Claims:
    """Say which actions the optimized observations make probable, and which none does."""
    models, names = evidence["class_model"], shown_actions(evidence).names
    pairs = zip(names, models["logit"]["probabilities"], strict=True)
    claims = {
        "class_model.reached": (
            "Probabilities of the actions on the observations optimized by logit: "
            f"{listed([f'{action} {p:.3f}' for action, p in pairs])}."
        )
    }
    highest = [max(p) for p in zip(*(models[o]["highest"] for o in _OBJECTIVES), strict=True)]
    unreached = [action for action, p in zip(names, highest, strict=True) if p <= 0.5]
    if unreached:
        attempts = sum(models[o]["starts"] * models[o]["num_settings"] for o in _OBJECTIVES)
        claims["class_model.not_reached"] = (
            f"None of the {attempts} attempts made {listed(unreached, 'or')} more probable than "
            "not; this does not show that no observation does."
        )
    return claims


def grid(explanations: Sequence[Explanation]) -> Image.Image:
    """Return images by policy and objective (rows) and action (columns), with probabilities."""
    grids = []
    for explanation in explanations:
        start = f"{explanation.name[:18]}: " if len(explanations) > 1 else ""
        row = [*tiles(explanation, start).values()]
        grids.append(images.gridded(row, len(explanation.actions.names)))
    return images.stacked(grids, gap=12)


def tiles(explanation: Explanation, start: str = "") -> dict[str, Image.Image]:
    """Return the images of one policy by caption, each with a start."""
    by_caption: dict[str, Image.Image] = {}
    numbers = explanation.numbers["class_model"]
    low, high = numbers["statistics"]["low"], numbers["statistics"]["high"]
    channels = numbers["channels"]
    for objective in _OBJECTIVES:
        reached = numbers[objective]["probabilities"]
        observations = explanation.arrays[f"class_model_{objective}"]
        for action in explanation.actions.order:
            image = images.shown_picture(observations[action], low, high, channels)
            name = explanation.actions.names[action]
            caption = f"{start}{name} {reached[action]:.3f} (by {objective})"
            by_caption[caption] = images.titled(images.enlarge(image), caption)
    return by_caption


PART = Part(
    title="Observations that maximize each action (class models)",
    label="Class models",
    needs=("class_model",),
    text={"class_model": say_class_models},
    draw=lambda explanation: {"class_model": tiles(explanation)},
    compare=lambda explanations: {"class_models": grid(explanations)},
)
