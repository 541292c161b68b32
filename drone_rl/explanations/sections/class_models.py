"""The picture that each action is waiting for."""

import dataclasses
from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations import class_model
from drone_rl.explanations.context import Context, LeftOutError


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "class_model"; arrays "class_model_probability" and "..._logit" (3, C, h, w)."""
    if not context.network.is_differentiable:
        raise LeftOutError(
            "Class models are sought along gradients, and the logits of this policy have none by "
            "the pixels; give it as a torch function of floats, which the transform rgb makes."
        )
    statistics = class_model.PictureStatistics.of(context.observations)
    numbers: dict[str, Any] = {
        "statistics": dataclasses.asdict(statistics),
        "color": context.scenes.is_color,
    }
    arrays = {}
    for objective in ("probability", "logit"):
        search = class_model.search(
            context.network, statistics, objective, seed=context.settings.seed
        )
        arrays[f"class_model_{objective}"] = search.pictures.numpy()
        numbers[objective] = search.summary()
    return {"class_model": numbers}, arrays
