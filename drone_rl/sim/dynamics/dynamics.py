"""What a way of moving must offer."""

from typing import Protocol

from torch import Tensor

from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics.body import BodyState


class Dynamics(Protocol):
    """Moves drones. It holds none: states come in, states go out, as many worlds as they have."""

    @property
    def actions(self) -> Actions:
        """What it can be told to do."""
        ...

    def start(self, position: Tensor) -> BodyState:
        """Drones at the start of an episode.

        Args:
            position: Where, metres, world frame. Shape: (num_worlds, 3), float64.
        """
        ...

    def step(self, body: BodyState, action: Tensor) -> BodyState:
        """What an action makes of each drone, a control step later; `body` stays as it is.

        Args:
            body: Before.
            action: One of `actions` for each. Shape: (num_worlds,), then that of `actions.entry`.
        """
        ...
