"""Under which conditions it is good: what `drone-rl shifts` found, if there is such a file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explanations.context import Context


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "shifts", as in `shifts.json`, or why it is "refused"; nothing where there is none.

    Arrays: "shifts_..." of each axis, what the camera shows with nothing different and at the five
    strengths, black where the task can't be so. Shapes: (6, H, W, 3).
    """
    measured = context.measured
    if measured is None:
        return {}, {}
    arrays = {
        f"shifts_{name}": np.stack([np.zeros_like(strip[0]) if p is None else p for p in strip])
        for name, strip in measured.pictures.items()
    }
    return {"shifts": measured.evidence}, arrays
