"""Computer-vision mode (Table 1): an action sets the drone's pose, and there are no forces."""

import torch
from torch import Tensor

from drone_rl.sim.actions import MOVES
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.dynamics.obstacles import Obstacles

DIRECTIONS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
"""Unit vector of each of `MOVES`, world frame."""


class ComputerVision:
    """Moves a step forward, to the left or to the right, at once and without turning."""

    actions = MOVES
    mount = "body"
    """A drone that never tilts needs no gimbal."""
    is_random = False
    needs_obstacles = False

    def __init__(self, step_length: float = 1.0) -> None:
        """Sets how far a move goes.

        Args:
            step_length: Metres.
        """
        self.step_length = step_length
        self.moves = torch.tensor(DIRECTIONS, dtype=torch.float64) * step_length
        """Metres, world frame. Shape: (number of actions, 3), float64."""

    def start(self, position: Tensor, seeds: Tensor | None = None) -> BodyState:
        """Drones that are level and at rest."""
        del seeds
        return BodyState.at_rest(position)

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """The same drones a move farther on."""
        del obstacles
        moves = self.moves.to(action.device)
        return body.moved(body.position + moves[action])
