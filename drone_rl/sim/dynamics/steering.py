"""From a policy's actions to what a flying drone's controllers are told."""

from typing import Protocol

import torch
from torch import Tensor

from drone_rl.config import ActionSettings
from drone_rl.sim.actions import MOVES, Actions
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics.computer_vision import DIRECTIONS
from drone_rl.sim.dynamics.flight_state import FlightState
from drone_rl.sim.dynamics.goals import Goals, Mode


class Steering(Protocol):
    """What actions mean."""

    @property
    def actions(self) -> Actions:
        """Which there are."""
        ...

    def goals(self, body: FlightState, action: Tensor) -> Goals:
        """What controllers are told until the next action.

        Args:
            body: The drones.
            action: One for each. Shape: (num_worlds,), then that of `actions.entry`.
        """
        ...


class Moves:
    """The chapter's moves, flown as steps of the place where a drone is wanted.

    A move shifts that place along one axis of the world. It is never farther from the drone, along
    either axis, than the lead: who moves on for long does not run away from the drone.
    """

    MODES = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
    actions = MOVES

    def __init__(self, settings: ActionSettings) -> None:
        """Takes the speed of moves and the lead."""
        self.lead = settings.move_lead
        self.drifts = torch.zeros(len(DIRECTIONS), 4, dtype=torch.float64)
        self.drifts[:, :2] = torch.tensor(DIRECTIONS, dtype=torch.float64)[:, :2]
        self.drifts *= settings.move_speed
        """How fast each move shifts the place. Metres a second. Shape: (moves, 4)."""

    def goals(self, body: FlightState, action: Tensor) -> Goals:
        """See `Steering`."""
        place = body.position[:, :2]
        wanted = body.reference.clone()
        wanted[:, :2] = place + (wanted[:, :2] - place).clamp(-self.lead, self.lead)
        return Goals(self.MODES, wanted, self.drifts.to(action.device)[action])


class Velocities:
    """Speed forward, speed to the left and rate of turning; the height is kept."""

    MODES = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.POSITION)

    def __init__(self, settings: ActionSettings) -> None:
        """Takes the greatest speeds."""
        self.actions = ContinuousActions.of(settings)

    def goals(self, body: FlightState, action: Tensor) -> Goals:
        """See `Steering`."""
        height = body.reference[:, 3:]
        return Goals(self.MODES, torch.cat([self.actions.to_rates(action), height], -1))


def make_steering(settings: ActionSettings) -> Moves | Velocities:
    """What the actions of some settings mean."""
    return Moves(settings) if settings.kind == "moves" else Velocities(settings)
