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


_SEEDS = 2**31 - 1
"""How many different episodes of random dynamics there are."""


class HasMoves(Protocol):
    """A task, as far as it says how drones move unless the user wants otherwise."""

    def make_dynamics(self) -> Dynamics:
        """In computer-vision mode, by moves."""
        ...


def make_dynamics(
    task: HasMoves,
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
) -> Dynamics:
    """How drones move.

    Args:
        task: Whose own choice holds where actions set poses and are moves.
        dynamics: Computer-vision mode by default; something that moves drones is taken as it is.
        actions: Moves by default.

    Raises:
        InputError: Actions are chosen for what brings its own.
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
    """One for each episode, see `Dynamics.start`; drawn after all that the task draws.

    Args:
        random_states: Of the episodes' worlds.

    Returns:
        Shape: (number of episodes,), int64.
    """
    return torch.tensor([int(r.randint(_SEEDS)) for r in random_states], dtype=torch.int64)
