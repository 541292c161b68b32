"""Computer-vision mode with speeds: an action says how fast to go and turn, and that happens."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.config.dynamics import ActionSettings
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics.body import BodyState, heading_of
from drone_rl.sim.dynamics.obstacles import Obstacles


class Kinematic:
    """Flies level at the speeds that are asked for, at once: a drone without a body's inertia.

    A step goes along the heading at its beginning, and then turns.
    """

    mount = "body"
    """A drone that never tilts needs no gimbal."""
    is_random = False
    needs_obstacles = False

    def __init__(self, actions: ActionSettings, timestep: float = 0.1) -> None:
        """Sets the greatest speeds.

        Args:
            actions: They say which.
            timestep: Seconds that an action lasts.
        """
        self.actions = ContinuousActions.of(actions)
        self.timestep = timestep

    def start(self, position: Tensor, seeds: Tensor | None = None) -> BodyState:
        """Drones that are level, look forward and are at rest."""
        del seeds
        return BodyState.at_rest(position)

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """The same drones a time step farther on; velocities are those of the step."""
        del obstacles
        forward, left, rate = self.actions.to_rates(action).unbind(-1)
        heading = heading_of(body.attitude)
        cos, sin, zero = heading.cos(), heading.sin(), torch.zeros_like(heading)
        velocity = torch.stack([cos * forward - sin * left, sin * forward + cos * left, zero], -1)
        half = (heading + rate * self.timestep) / 2
        return dataclasses.replace(
            body,
            position=body.position + velocity * self.timestep,
            attitude=torch.stack([half.cos(), zero, zero, half.sin()], -1),
            velocity=velocity,
            angular_velocity=torch.stack([zero, zero, rate], -1),
        )
