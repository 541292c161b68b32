"""What a way of moving must offer."""

from typing import Protocol

from torch import Tensor

from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.dynamics.obstacles import Obstacles


class Dynamics(Protocol):
    """Moves drones. It holds none: states come in, states go out, as many worlds as they have.

    Who derives from it needs `actions`, `start` and `step` alone: nothing is random then, nothing
    but the task's rules knows of obstacles, and cameras are fixed to the body.
    """

    @property
    def actions(self) -> Actions:
        """What it can be told to do."""
        ...

    @property
    def mount(self) -> str:
        """What holds the drone's cameras: "body", or "gimbal", which keeps them level."""
        return "body"

    @property
    def is_random(self) -> bool:
        """Whether episodes differ by their `seeds`."""
        return False

    @property
    def needs_obstacles(self) -> bool:
        """Whether `step` must be told what the drone can fly into."""
        return False

    def start(self, position: Tensor, seeds: Tensor | None = None) -> BodyState:
        """Drones at the start of an episode.

        Args:
            position: Where, metres, world frame. Shape: (num_worlds, 3), float64.
            seeds: Of what is random about each episode; none where `is_random` is false, and in
                imagined worlds, of which everything is like the mean. Shape: (num_worlds,), int64.
        """
        ...

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """What an action makes of each drone, a control step later; `body` stays as it is.

        Args:
            body: Before.
            action: One of `actions` for each. Shape: (num_worlds,), then that of `actions.entry`.
            obstacles: Of each world, as far as there are any and `needs_obstacles` is true.
        """
        ...
