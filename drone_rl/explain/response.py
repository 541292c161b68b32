"""The response map: what a policy does about one cube, wherever it stands."""

import dataclasses
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explain.hooks import probabilities
from drone_rl.explain.intervals import mean_interval
from drone_rl.explain.scenes import Scenes, empty_scene, oracle_action, place_cube
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.rules import Action

BLIND = 0.1
"""A policy is blind to a cube that changes its action probabilities by less than this."""
_MIRRORED = [Action.FORWARD, Action.RIGHT, Action.LEFT]
"""What each action becomes in a mirror."""


@dataclasses.dataclass
class ResponseMap:
    """Action probabilities for one cube at every place of a grid; F ahead, L sideways."""

    forward: NDArray  # (F,)
    """Metres ahead of the drone."""
    lateral: NDArray  # (L,)
    """Metres to its left."""
    probabilities: NDArray  # (F, L, 3)
    """By `Action`."""
    without_cube: NDArray  # (3,)
    """The same for the scene without a cube."""
    oracle: NDArray  # (F, L)
    """What the oracle does."""

    @property
    def action(self) -> NDArray:
        """The most probable action. Shape: (F, L)."""
        return self.probabilities.argmax(-1)

    @property
    def blind(self) -> NDArray:
        """Where the cube calls for a turn and the policy doesn't notice it. Shape: (F, L)."""
        change = 0.5 * np.abs(self.probabilities - self.without_cube).sum(-1)
        wrong = self.action != self.oracle
        return (change < BLIND) & wrong

    @property
    def answered(self) -> NDArray:
        """Sideways places to which the policy turns in time, and away from which never.

        A policy need not turn to a cube that is still far, so a column of the map counts as
        answered if somewhere on the way the policy does what the oracle does, and nowhere the
        opposite. Shape: (L,).
        """
        opposite = np.array(_MIRRORED)[self.oracle]
        turns_away = (self.action == opposite) & (self.oracle != Action.FORWARD)
        return (self.action == self.oracle).any(0) & ~turns_away.any(0)

    def summary(self) -> dict[str, Any]:
        """Counts for people and programs."""
        left, right = self.oracle == Action.LEFT, self.oracle == Action.RIGHT
        agrees = self.action == self.oracle
        return {
            "grid": [len(self.lateral), len(self.forward)],
            "agrees_with_oracle": float(agrees.mean()),
            "left_agrees": float(agrees[left].mean()),
            "right_agrees": float(agrees[right].mean()),
            "ahead_agrees": float(agrees[~left & ~right].mean()),
            "left_answered": float(self.answered[left[0]].mean()),
            "right_answered": float(self.answered[right[0]].mean()),
            "left_blind": float(self.blind[left].mean()),
            "right_blind": float(self.blind[right].mean()),
            "without_cube": self.without_cube.tolist(),
        }


def response_map(
    scenes: Scenes,
    network: PolicyNetwork,
    *,
    num_lateral: int = 41,
    num_forward: int = 31,
    reach: float | None = None,
) -> ResponseMap:
    """Draws one cube at every place of a grid, in one batch, and asks the policy about each.

    Args:
        scenes: Where they are drawn.
        network: The policy's.
        num_lateral: Places sideways, symmetric about the middle.
        num_forward: Places ahead, from touching to where an episode's first cube stands.
        reach: Metres sideways; as far as a next cube ever stands by default.
    """
    settings = scenes.worlds.settings
    reach = reach or 2.0 * settings.lateral_bound or settings.touch_distance * 2
    nearest = settings.touch_distance + 0.5 * settings.step_length
    forward = torch.linspace(nearest, settings.first_distance, num_forward).double()
    lateral = torch.linspace(reach, -reach, num_lateral).double()
    ahead, aside = torch.meshgrid(forward, lateral, indexing="ij")
    observed = scenes.observe(place_cube(scenes, ahead.flatten(), aside.flatten()))
    probs = probabilities(network, observed).view(num_forward, num_lateral, -1)
    alone = probabilities(network, scenes.observe(empty_scene(scenes)))[0]
    return ResponseMap(
        forward=forward.numpy(),
        lateral=lateral.numpy(),
        probabilities=probs.cpu().numpy(),
        without_cube=alone.cpu().numpy(),
        oracle=oracle_action(scenes, aside).numpy(),
    )


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
    there = probabilities(network, observations.flip(-1))[:, _MIRRORED]
    signed = (here - there)[:, Action.LEFT].double().cpu().numpy()
    distance = 0.5 * (here - there).abs().sum(-1).double().cpu().numpy()
    worst = np.argsort(-distance, kind="stable")[:8]
    return {
        "signed": mean_interval(signed, episode),
        "absolute": mean_interval(distance, episode),
        "worst": [{"frame": int(t), "distance": float(distance[t])} for t in worst],
    }


def grid_asymmetry(response: ResponseMap) -> dict[str, Any]:
    """The same over a response map, whose mirror image is itself read backwards."""
    there = response.probabilities[:, ::-1][..., _MIRRORED]
    difference = response.probabilities - there
    distance = 0.5 * np.abs(difference).sum(-1)
    at = np.unravel_index(distance.argmax(), distance.shape)
    return {
        "signed": float(difference[..., Action.LEFT].mean()),
        "absolute": float(distance.mean()),
        "worst": {
            "distance": float(distance.max()),
            "forward": float(response.forward[at[0]]),
            "lateral": float(response.lateral[at[1]]),
        },
    }
