"""Left against right: a policy and its mirror image."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.intervals import mean_interval
from drone_rl.explanations.response import ResponseMap
from drone_rl.policies import PictureNetwork
from drone_rl.sim.actions import Actions


def asymmetry(
    network: PictureNetwork, observations: Tensor, episode: NDArray, actions: Actions
) -> dict[str, Any]:
    """pi(left | x) against pi(right | mirrored x), over a data set.

    Args:
        network: The policy's.
        observations: Shape (T, C, H, W).
        episode: Shape (T,).
        actions: What it can do.

    Returns:
        "signed": the mean of pi(left | x) - pi(right | mirrored x), below 0 if the policy prefers
        right; "absolute": the mean distance between the policy and its mirror
        image; "worst": frames in order of that distance, with it.
    """
    here = probabilities(network, observations)
    there = actions.mirror(probabilities(network, observations.flip(-1)))
    signed = (actions.leaning(here) - actions.leaning(there)).double().cpu().numpy()
    distance = actions.distance(here, there).double().cpu().numpy()
    worst = np.argsort(-distance, kind="stable")[:8]
    return {
        "signed": mean_interval(signed, episode, low=-1.0),
        "absolute": mean_interval(distance, episode),
        "worst": [{"frame": int(t), "distance": float(distance[t])} for t in worst],
    }


def grid_asymmetry(response: ResponseMap, actions: Actions) -> dict[str, Any]:
    """The same over a response map, whose mirror image is itself read backwards."""
    here, there = response.probabilities, actions.mirror(response.probabilities[:, :, ::-1])
    signed, distance = actions.leaning(here) - actions.leaning(there), actions.distance(here, there)
    at = np.unravel_index(distance.argmax(), distance.shape)
    return {
        "signed": float(signed.mean()),
        "absolute": float(distance.mean()),
        "worst": {
            "distance": float(distance.max()),
            "height": float(response.height[at[0]]),
            "forward": float(response.forward[at[1]]),
            "lateral": float(response.lateral[at[2]]),
        },
    }
