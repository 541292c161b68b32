"""The response map: what a policy does about one cube wherever it stands, and what comes of it."""

import dataclasses
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explain.flying import fly_on
from drone_rl.explain.hooks import probabilities
from drone_rl.explain.scenes import Scenes, empty_scene, oracle_action, place_cube
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.actions import Move

BLIND = 0.1
"""A policy is blind to a cube that changes its action probabilities by less than this."""
MIRRORED = (Move.FORWARD, Move.RIGHT, Move.LEFT)
"""What each action becomes in a mirror."""


@dataclasses.dataclass
class ResponseMap:
    """Move probabilities for one cube at every place of a grid: Z up, F ahead, L sideways."""

    height: NDArray  # (Z,)
    """Metres above the drone."""
    forward: NDArray  # (F,)
    """Metres ahead of it."""
    lateral: NDArray  # (L,)
    """Metres to its left."""
    probabilities: NDArray  # (Z, F, L, 3)
    """By `Move`."""
    without_cube: NDArray  # (3,)
    """The same for the scene without a cube."""
    oracle: NDArray  # (L,)
    """What must be done: a turn where flying straight on would miss."""

    @property
    def action(self) -> NDArray:
        """The most probable action. Shape: (Z, F, L)."""
        return self.probabilities.argmax(-1)

    @property
    def blind(self) -> NDArray:
        """Where the cube calls for a turn and the policy doesn't notice it. Shape: (Z, F, L)."""
        change = 0.5 * np.abs(self.probabilities - self.without_cube).sum(-1)
        calls = self.oracle != Move.FORWARD
        return (change < BLIND) & calls & (self.action != self.oracle)


@dataclasses.dataclass
class OutcomeMap:
    """Whether the policy, flying on greedily, collects a cube that stands there."""

    height: NDArray  # (Z,)
    forward: NDArray  # (f,)
    lateral: NDArray  # (l,)
    """As in `ResponseMap`."""
    collected: NDArray  # (Z, f, l) bool
    oracle: NDArray  # (l,)


def response_map(
    scenes: Scenes, network: PolicyNetwork, *, num_lateral: int = 41, num_forward: int = 31
) -> ResponseMap:
    """Draws one cube at every place of a grid and asks the policy about each.

    Args:
        scenes: Where they are drawn.
        network: The policy's.
        num_lateral: Places sideways; see `_places`.
        num_forward: Places ahead.
    """
    height, forward, lateral = _places(scenes, num_forward, num_lateral)
    ahead, aside = torch.meshgrid(forward, lateral, indexing="ij")
    layers = []
    for up in height.tolist():
        observed = scenes.observe(place_cube(scenes, ahead.flatten(), aside.flatten(), up))
        layers.append(probabilities(network, observed).view(num_forward, num_lateral, -1))
    alone = probabilities(network, scenes.observe(empty_scene(scenes)))[0]
    return ResponseMap(
        height=height.numpy(),
        forward=forward.numpy(),
        lateral=lateral.numpy(),
        probabilities=torch.stack(layers).cpu().numpy(),
        without_cube=alone.cpu().numpy(),
        oracle=oracle_action(scenes, lateral).numpy(),
    )


def outcome_map(
    scenes: Scenes, network: PolicyNetwork, *, num_lateral: int = 21, num_forward: int = 8
) -> OutcomeMap:
    """Flies on from every place of a coarser grid, and sees whether the cube is collected.

    Args:
        scenes: Where the flights are drawn.
        network: The policy's.
        num_lateral: Places sideways; see `_places`.
        num_forward: Places ahead.
    """
    height, forward, lateral = _places(scenes, num_forward, num_lateral)
    ahead, aside = torch.meshgrid(forward, lateral, indexing="ij")
    layers = []
    for up in height.tolist():
        starts = place_cube(scenes, ahead.flatten(), aside.flatten(), up)
        ends = fly_on(scenes, network, starts)
        layers.append(ends.collected[:, 0].view(num_forward, num_lateral))
    return OutcomeMap(
        height=height.numpy(),
        forward=forward.numpy(),
        lateral=lateral.numpy(),
        collected=torch.stack(layers).cpu().numpy(),
        oracle=oracle_action(scenes, lateral).numpy(),
    )


def summarise(response: ResponseMap, outcome: OutcomeMap) -> dict[str, Any]:
    """Counts for people and programs.

    Returns:
        "without_cube"; "rows": for each height and side ("left", "ahead" where flying straight on
        is enough, "right") the share of "places" at which the policy is "blind" (of the response
        map) and from which the cube is "collected" (of the outcome map); None where no place of
        the grid lies on that side.
    """
    rows = []
    for layer, height in enumerate(response.height.tolist()):
        for side, action in (
            ("left", Move.LEFT), ("ahead", Move.FORWARD), ("right", Move.RIGHT),
        ):  # fmt: skip
            blind = response.blind[layer][:, response.oracle == action]
            collected = outcome.collected[layer][:, outcome.oracle == action]
            rows.append(
                {
                    "height": height,
                    "side": side,
                    "blind": float(blind.mean()) if blind.size else None,
                    "collected": int(collected.sum()),
                    "places": int(collected.size),
                }
            )
    return {"without_cube": response.without_cube.tolist(), "blind_below": BLIND, "rows": rows}


def _places(scenes: Scenes, num_forward: int, num_lateral: int) -> tuple[Tensor, Tensor, Tensor]:
    """Metres up, ahead and to the left at which cubes can stand, seen from the drone.

    Ahead: from all but touching to where an episode's first cube stands. Sideways: symmetric, as
    far as a next cube ever stands. Up: where the task places them; level, lowest and highest.
    """
    settings = scenes.worlds.task.settings
    reach = 2.0 * settings.lateral_bound or settings.touch_distance * 2
    nearest = settings.touch_distance + 0.5 * settings.step_length
    bound = settings.vertical_bound
    height = torch.tensor([-bound, 0.0, bound] if bound else [0.0], dtype=torch.float64)
    forward = torch.linspace(nearest, settings.first_distance, num_forward).double()
    return height, forward, torch.linspace(reach, -reach, num_lateral).double()
