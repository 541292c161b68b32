"""Does it treat a mirrored picture in a mirrored way?"""

from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations.asymmetry import asymmetry, grid_asymmetry
from drone_rl.explanations.context import Context


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "asymmetry": on the "dataset" and on the "grid" of the response map."""
    actions = context.scenes.actions
    numbers = {
        "dataset": asymmetry(context.network, context.observations, context.episode, actions),
        "grid": grid_asymmetry(context.response, actions),
    }
    return {"asymmetry": numbers}, {}
