"""How a drone moves: the protocol, moves and speeds without inertia, and the choice by settings."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import COMPUTER_VISION, MOVES_SETTINGS, ActionSettings, DynamicsSettings
from drone_rl.sim.actions import MOVE_SETS, MOVES, Actions
from drone_rl.sim.continuous_actions import YAW, ContinuousActions
from drone_rl.sim.dynamics.moves_kernel import move_all
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.sim.dynamics.state import BodyState, Obstacles
from drone_rl.sim.dynamics.velocity_kernel import glide_all
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance, shown


class Dynamics(Protocol):
    """Functions that move drones. A subclass needs only `actions` and `step`."""

    actions: Actions
    mount: str = "body"
    """Camera mount: "body", or "gimbal", which keeps cameras level."""
    is_random: bool = False
    """Whether `start` uses its `seeds`."""
    needs_obstacles: bool = False
    """Whether `step` needs the obstacles."""
    stops_at_solids: bool = False
    """Whether `step` needs them in scene files, whose solids stop the drones."""
    timestep: float | None = None
    """Seconds that an action lasts; None if it is done at once."""
    stride: float = math.inf
    """Metres that an action goes at most; infinite if that is unknown."""

    def start(self, position: Tensor, seeds: Tensor | None = None) -> BodyState:
        """Return drones at the start of an episode; by default they are level and at rest.

        Positions are metres, world frame, shape (num_envs, 3), float64. Seeds, (num_envs,),
        int64, are those of each episode's random quantities, which otherwise have their mean.
        """
        return BodyState.at_rest(position)

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """Return the drones a control step later; `body` stays as it is.

        `action` is one of `actions` for each; shape (num_envs, *actions.entry.shape).
        `obstacles` are given if `needs_obstacles` and there are any, and in scene files if
        `stops_at_solids`.
        """
        ...


class ComputerVision(Dynamics):
    """Moves of one length along the drone's heading, and turns about z; both are done at once.

    What is solid in a scene file ends a move.
    """

    stops_at_solids = True

    def __init__(
        self, step_length: float = 1.0, actions: Actions = MOVES, turn_step: float = 0.0
    ) -> None:
        """Set the length of a move, metres, the set of moves, and the angle of a turn, degrees."""
        self.step_length = self.stride = step_length
        self.actions: Actions = actions
        speeds = actions.speeds_of(torch.arange(len(actions))).double()
        half = 0.5 * math.radians(turn_step) * speeds[:, 3]
        self.moves = speeds[:, :3] * step_length
        """Metres, in the drone's frame. Shape: (number of actions, 3), float64."""
        self.turns = torch.stack([half.cos(), half.sin()], -1)
        """Cosine and sine of half the angle to the left. Shape: (number of actions, 2), float64."""

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """Return the drones after a move."""
        moves, turns = self.moves.to(action.device), self.turns.to(action.device)
        position, attitude = move_all(body.position, body.attitude, action, moves, turns)
        if obstacles is not None and obstacles.scene is not None:
            position = obstacles.scene.reached(body.position, position)
        return body.moved(position, attitude)


class Kinematic(Dynamics):
    """Flies level at the commanded speeds, without inertia; a step moves first, and then turns.

    What is solid in a scene file ends the movement of a step.
    """

    stops_at_solids = True

    def __init__(self, actions: ActionSettings, timestep: float = 0.1) -> None:
        """Take the greatest speeds, and the seconds that an action lasts."""
        self._continuous = ContinuousActions.of(actions)
        self.actions: Actions = self._continuous
        self.timestep = self._seconds = timestep
        self.stride = actions.forward_speed * timestep

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> BodyState:
        """Return the drones a time step later; velocities are those of the step."""
        rates = self._continuous.to_rates(action)
        moved = glide_all(body.position, body.attitude, rates, self._seconds)
        position, attitude, velocity = moved
        if obstacles is not None and obstacles.scene is not None:
            position = obstacles.scene.reached(body.position, position)
            velocity = (position - body.position) / self._seconds
        turn = rates[..., YAW]
        zero = torch.zeros_like(turn)
        return dataclasses.replace(
            body,
            position=position,
            attitude=attitude,
            velocity=velocity,
            angular_velocity=torch.stack([zero, zero, turn], -1),
        )


def make_dynamics(
    default: Callable[[], Dynamics],
    dynamics: DynamicsSettings | Dynamics | None = None,
    actions: ActionSettings | None = None,
) -> Dynamics:
    """Return the given dynamics, or build them from settings.

    `default` builds the task's dynamics for discrete moves in computer-vision mode, which are those
    without settings. Raises an `InputError` if both dynamics and settings of actions are given, or
    they don't fit each other.
    """
    actions = Instance(ActionSettings | None).read(actions, "actions")
    if dynamics is not None and not isinstance(dynamics, DynamicsSettings):
        if isinstance(dynamics, type) or not hasattr(dynamics, "step"):
            raise InputError(
                f"dynamics={shown(dynamics)} is no Dynamics object; give settings such as "
                "drone_rl.DynamicsSettings(mode='simple_flight')"
            )
        if actions is not None:
            raise InputError(
                f"actions={actions.kind}, but dynamics={type(dynamics).__name__} brings its own; "
                "give settings of dynamics, or no actions"
            )
        return dynamics
    dynamics, actions = dynamics or COMPUTER_VISION, actions or MOVES_SETTINGS
    if not dynamics.is_computer_vision:
        return Quadrotor(dynamics, actions)
    if actions.kind == "velocity":
        return Kinematic(actions, dynamics.control_timestep)
    moves = default()
    if actions.kind == "moves":
        return moves
    if type(moves) is not ComputerVision:
        raise InputError(f"actions={actions.kind} needs a task with moves; give actions=moves")
    return ComputerVision(moves.step_length, MOVE_SETS[actions.kind], actions.turn_step)


def draw_seeds(random_states: Sequence[np.random.RandomState]) -> Tensor:
    """Sample a seed for each episode, after the task has sampled. Shape: (N,), int64."""
    return torch.tensor([int(r.randint(2**31 - 1)) for r in random_states], dtype=torch.int64)
