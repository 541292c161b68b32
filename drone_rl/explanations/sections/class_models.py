"""The picture that each action is waiting for."""

import copy
import dataclasses
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations import class_model
from drone_rl.explanations.attribution import Objective
from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.threads import aside

OBJECTIVES: tuple[Objective, ...] = ("probability", "logit")
"""Of which an action shall have more."""


@aside
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
        "channels": context.scenes.channels,
    }
    arrays = {}

    def seek(objective: Objective) -> class_model.ClassModel:
        network = copy.deepcopy(context.network)  # gradients are gathered in it
        return class_model.search(network, statistics, objective, seed=context.seed.value)

    with ThreadPoolExecutor(len(OBJECTIVES)) as pool:  # steps of small pictures take one core
        found = dict(zip(OBJECTIVES, pool.map(seek, OBJECTIVES), strict=True))
    for objective, search in found.items():
        arrays[f"class_model_{objective}"] = search.pictures.numpy()
        numbers[objective] = search.summary()
    return {"class_model": numbers}, arrays
