"""What the data set is like."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explain.context import Context


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "dataset"."""
    data = context.dataset
    probs = data.probabilities.astype(np.float64)
    entropy = -(probs * np.log(np.maximum(probs, 1e-12))).sum(-1) / np.log(probs.shape[-1])
    counts = np.bincount(data.actions, minlength=probs.shape[-1])
    numbers = {
        "frames": len(data),
        "episodes": len(np.unique(data.episode)),
        "action_shares": (counts / counts.sum()).tolist(),
        "mean_entropy": float(entropy.mean()),
        "cubes_collected": int(data.rewards.sum()),
    }
    return {"dataset": numbers}, {}
