"""What it does about one cube, wherever that stands, and about mirrored pictures."""

import dataclasses
from typing import Any

from numpy.typing import NDArray

from drone_rl.explain import response
from drone_rl.explain.context import Context


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "response" and "asymmetry"; arrays "response_...", the fields of a `ResponseMap`."""
    found = response.response_map(context.scenes, context.network)
    arrays = {f"response_{f.name}": getattr(found, f.name) for f in dataclasses.fields(found)}
    arrays["response_blind"] = found.blind
    asymmetry = {
        "dataset": response.asymmetry(context.network, context.observations, context.episode),
        "grid": response.grid_asymmetry(found),
    }
    return {"response": found.summary(), "asymmetry": asymmetry}, arrays
