"""What it does about one cube, wherever that stands."""

import dataclasses
from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations.context import Context
from drone_rl.explanations.response import outcome_map, summarise


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "response".

    Arrays: "response_..." and "outcome_...", the fields of `ResponseMap` and `OutcomeMap`.
    """
    response = context.response
    outcome = outcome_map(context.scenes, context.network, seed=context.seed.value)
    arrays = {
        f"{name}_{field.name}": getattr(one, field.name)
        for name, one in (("response", response), ("outcome", outcome))
        for field in dataclasses.fields(one)
    }
    return {"response": summarise(response, outcome, context.scenes.task.strata)}, arrays
