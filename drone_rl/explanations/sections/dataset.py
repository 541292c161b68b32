"""What the data set is like."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explanations.context import Context
from drone_rl.explanations.intervals import mean_interval


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "dataset"."""
    data, flights = context.dataset, context.flights
    probs = data.probabilities.astype(np.float64)
    entropy = -(probs * np.log(np.maximum(probs, 1e-12))).sum(-1) / np.log(probs.shape[-1])
    counts = np.bincount(flights.actions, minlength=probs.shape[-1])
    numbers = {
        "frames": len(data),
        "episodes": len(np.unique(flights.episode)),
        "steps": len(flights),
        "action_shares": (counts / counts.sum()).tolist(),
        "entropy": mean_interval(entropy.clip(0.0, 1.0), data.episode),
        "goals_reached": int((flights.event > 0).sum()),
    }
    return {"dataset": numbers}, {}
