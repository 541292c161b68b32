"""What it does about one cube, wherever that stands, and about mirrored pictures."""

import dataclasses
from typing import Any

from numpy.typing import NDArray

from drone_rl.explain.asymmetry import asymmetry, grid_asymmetry
from drone_rl.explain.context import Context
from drone_rl.explain.response import outcome_map, response_map, summarise


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "response" and "asymmetry".

    Arrays: "response_..." and "outcome_...", the fields of `ResponseMap` and `OutcomeMap`.
    """
    found = response_map(context.scenes, context.network)
    outcome = outcome_map(context.scenes, context.network)
    arrays = {
        f"{name}_{field.name}": getattr(one, field.name)
        for name, one in (("response", found), ("outcome", outcome))
        for field in dataclasses.fields(one)
    }
    arrays["response_blind"] = found.blind
    numbers = {
        "response": summarise(found, outcome),
        "asymmetry": {
            "dataset": asymmetry(context.network, context.observations, context.episode),
            "grid": grid_asymmetry(found),
        },
    }
    return numbers, arrays
