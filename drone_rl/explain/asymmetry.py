"""Left against right: a policy and its mirror image."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explain.hooks import probabilities
from drone_rl.explain.intervals import mean_interval
from drone_rl.explain.response import MIRRORED, ResponseMap
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.actions import Move


def asymmetry(network: PolicyNetwork, observations: Tensor, episode: NDArray) -> dict[str, Any]:
    """pi(left | x) against pi(right | mirrored x), over a data set.

    Args:
        network: The policy's.
        observations: Shape (T, C, H, W).
        episode: Shape (T,).

    Returns:
        "signed": the mean of pi(left | x) - pi(right | mirrored x), below 0 if the policy prefers
        right; "absolute": the mean distance (total variation) between the policy and its mirror
        image; "worst": frames in order of that distance, with it.
    """
    here = probabilities(network, observations)
    there = probabilities(network, observations.flip(-1))[:, MIRRORED]
    signed = (here - there)[:, Move.LEFT].double().cpu().numpy()
    distance = 0.5 * (here - there).abs().sum(-1).double().cpu().numpy()
    worst = np.argsort(-distance, kind="stable")[:8]
    return {
        "signed": mean_interval(signed, episode, low=-1.0),
        "absolute": mean_interval(distance, episode),
        "worst": [{"frame": int(t), "distance": float(distance[t])} for t in worst],
    }


def grid_asymmetry(response: ResponseMap) -> dict[str, Any]:
    """The same over a response map, whose mirror image is itself read backwards."""
    there = response.probabilities[:, :, ::-1][..., MIRRORED]
    difference = response.probabilities - there
    distance = 0.5 * np.abs(difference).sum(-1)
    at = np.unravel_index(distance.argmax(), distance.shape)
    return {
        "signed": float(difference[..., Move.LEFT].mean()),
        "absolute": float(distance.mean()),
        "worst": {
            "distance": float(distance.max()),
            "height": float(response.height[at[0]]),
            "forward": float(response.forward[at[1]]),
            "lateral": float(response.lateral[at[2]]),
        },
    }
