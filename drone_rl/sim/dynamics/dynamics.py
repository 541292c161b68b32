"""How a drone moves: the protocol, moves and speeds without inertia, and the choice by settings."""

import dataclasses
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import COMPUTER_VISION, MOVES_SETTINGS, ActionSettings, DynamicsSettings
from drone_rl.sim.actions import DIRECTIONS, MOVES, Actions
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.sim.dynamics.state import BodyState, Obstacles, heading_of
from drone_rl.utils.errors import InputError


class Dynamics(Protocol):
    """Functions that move drones. A subclass needs only `actions`, `start` and `step`."""

    @property
    def actions(self) -> Actions:
        """The action set."""
        ...

    @property
    def mount(self) -> str:
        """Camera mount: "body", or "gimbal", which keeps cameras level."""
        return "body"

    @property
    def is_random(self) -> bool:
        """Whether `start` uses its `seeds`."""
        return False

    @property
    def needs_obstacles(self) -> bool:
        """Whether `step` needs the obstacles."""
        return False

    def start(self, position: Tensor, seeds: Tensor | None = None) -> BodyState:
        """Return drones at the start of an episode.

        Args:
            position: Metres, world frame. Shape: (num_worlds, 3), float64.
            seeds: Of the randomness of each episode; the mean without. Shape: (num_worlds,), int64.
        """
        ...

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """Return the drones a control step later.

        Args:
            body: Before; stays as it is.
            action: One of `actions` for each. Shape: (num_worlds,), then that of `actions.entry`.
            obstacles: Of each environment, if `needs_obstacles` and there are any.
        """
        ...


class _Level:
    """Drones that never tilt: without randomness and without contacts."""

    mount = "body"
    """A drone that never tilts needs no gimbal."""
    is_random = False
    needs_obstacles = False

    def start(self, position: Tensor, seeds: Tensor | None = None) -> BodyState:
        """Return drones that are level, face forward and are at rest."""
        del seeds
        return BodyState.at_rest(position)


class ComputerVision(_Level):
    """Moves a step forward, left or right, at once and without turning."""

    actions = MOVES

    def __init__(self, step_length: float = 1.0) -> None:
        """Set the length of a move, metres."""
        self.step_length = step_length
        self.moves = torch.tensor(DIRECTIONS, dtype=torch.float64) * step_length
        """Metres, world frame. Shape: (number of actions, 3), float64."""

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """Return the drones after a move."""
        del obstacles
        moves = self.moves.to(action.device)
        return body.moved(body.position + moves[action])


class Kinematic(_Level):
    """Flies level at the commanded speeds, without inertia; a step moves first, and then turns."""

    def __init__(self, actions: ActionSettings, timestep: float = 0.1) -> None:
        """Take the greatest speeds, and the seconds that an action lasts."""
        self.actions = ContinuousActions.of(actions)
        self.timestep = timestep

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """Return the drones a time step later; velocities are those of the step."""
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


_SEEDS = 2**31 - 1
"""Number of seeds of random dynamics."""


class HasMoves(Protocol):
    """A task, which has default dynamics."""

    def make_dynamics(self) -> Dynamics:
        """See `Task.make_dynamics`."""
        ...


def make_dynamics(
    task: HasMoves,
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
) -> Dynamics:
    """Return the dynamics of settings.

    Args:
        task: Its own dynamics are used for moves in computer-vision mode.
        dynamics: Settings, computer-vision mode by default; or dynamics, which are returned.
        actions: Moves by default.

    Raises:
        InputError: Both dynamics and settings of actions are given.
    """
    if dynamics is not None and not isinstance(dynamics, DynamicsSettings):
        if actions is not None:
            raise InputError(
                f"actions={actions.kind}, but dynamics={type(dynamics).__name__} brings its own; "
                "give settings of dynamics, or no actions"
            )
        return dynamics
    dynamics, actions = dynamics or COMPUTER_VISION, actions or MOVES_SETTINGS
    if not dynamics.is_computer_vision:
        return Quadrotor(dynamics, actions)
    if actions.kind == "moves":
        return task.make_dynamics()
    return Kinematic(actions, dynamics.control_timestep)


def draw_seeds(random_states: Sequence[np.random.RandomState]) -> Tensor:
    """Sample a seed for each episode, after the task has sampled. Shape: (N,), int64."""
    return torch.tensor([int(r.randint(_SEEDS)) for r in random_states], dtype=torch.int64)
