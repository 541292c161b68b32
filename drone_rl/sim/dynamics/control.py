"""Goals of the flight controller, axis by axis as in SimpleFlight, and the goals of actions."""

import dataclasses
import enum
import math

import torch
from torch import Tensor

from drone_rl.config import ActionSettings
from drone_rl.sim.actions import MOVE_SETS
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics.state import FlightState

X, Y, HEADING, Z = range(4)
"""Axes of `FlightGoals`; the first two are roll and pitch if their mode is an angle or a rate."""


class Mode(enum.IntEnum):
    """Quantity that an axis's goal sets; the controllers below it in the cascade set the rest."""

    THROTTLE = 0
    """Fraction of full thrust, 0 to 1."""
    RATE = 1
    """Radians a second about the body's axis."""
    ANGLE = 2
    """Radians: roll, pitch, heading."""
    VELOCITY = 3
    """Metres a second, world frame."""
    HEADING_VELOCITY = 4
    """Metres a second, forward and to the left of the heading."""
    POSITION = 5
    """Metres, world frame."""
    ROTOR = 6
    """Fraction of a rotor's full thrust, 0 to 1; all four axes are rotors then."""
    HEADING_POSITION = 7
    """A position, metres, world frame, which drifts forward and to the left of the goal's heading,
    an angle."""


Modes = tuple[Mode, Mode, Mode, Mode]


@dataclasses.dataclass(frozen=True)
class FlightGoals:
    """Goals of drones' controllers, all in the same modes."""

    modes: Modes
    """Of x (or roll), y (or pitch), heading and height. The first two are the same; `ROTOR` is the
    mode of all four or of none; headings have no other mode than `RATE` and `ANGLE`."""
    values: Tensor  # (num_envs, 4) float64
    drift: Tensor | None = None  # (num_envs, 4) float64
    """Rate of change of positions and headings per second; 0 by default. World frame, but see
    `HEADING_POSITION`."""

    @property
    def drifts(self) -> Tensor:
        """`drift`, zeros if it is None."""
        return torch.zeros_like(self.values) if self.drift is None else self.drift

    @property
    def world_drifts(self) -> Tensor:
        """`drifts` in the world frame."""
        if self.modes[X] is not Mode.HEADING_POSITION:
            return self.drifts
        (x, y, turn, up), heading = self.drifts.unbind(-1), self.values[:, HEADING]
        cos, sin = heading.cos(), heading.sin()
        return torch.stack([cos * x - sin * y, sin * x + cos * y, turn, up], -1)

    def reference_after(self, seconds: float, body: FlightState) -> Tensor:
        """Return `FlightState.reference` after `seconds` of a command; `body` has the drones."""
        places = Mode.POSITION, Mode.HEADING_POSITION
        has_target = [mode in places for mode in self.modes]
        has_target[HEADING] = self.modes[HEADING] is Mode.ANGLE
        target = self.values + seconds * self.world_drifts
        return torch.where(torch.tensor(has_target), target, body.settled().reference)


def rotor_goals(rotors: Tensor) -> FlightGoals:
    """Return goals that set rotors directly. Shape: (num_envs, 4)."""
    return FlightGoals((Mode.ROTOR, Mode.ROTOR, Mode.ROTOR, Mode.ROTOR), rotors)


class Moves:
    """Moves and turns: each moves the target position, or heading, at a constant speed.

    At the start of a move, the target is at most the lead away from the drone, along each axis.
    """

    modes: Modes = (Mode.HEADING_POSITION, Mode.HEADING_POSITION, Mode.ANGLE, Mode.POSITION)

    def __init__(self, settings: ActionSettings, most_turn: float = math.inf) -> None:
        """Take settings, and the yaw rate that the drone can follow, radians a second."""
        self.actions = actions = MOVE_SETS[settings.kind]
        self.lead, self.climbs = settings.move_lead, "up" in actions.names
        self._axes, self._places = ([X, Y, Z], [0, 1, 2]) if self.climbs else ([X, Y], [0, 1])
        speeds = actions.speeds_of(torch.arange(len(actions))).double()
        ahead, left, up = (settings.move_speed * speeds[:, :3]).unbind(-1)
        turn = min(math.radians(settings.yaw_rate), most_turn) * speeds[:, 3]
        self.drifts = torch.stack([ahead, left, turn, up], -1)
        """Speed of the target for each move, metres or radians a second. Shape: (moves, 4)."""

    def goals(self, body: FlightState, action: Tensor) -> FlightGoals:
        """Return the goals until the next action. `action`: (num_envs,)."""
        place, wanted = body.position[:, self._places], body.reference.clone()
        away = (wanted[:, self._axes] - place).clamp(-self.lead, self.lead)
        wanted[:, self._axes] = place + away
        return FlightGoals(self.modes, wanted, self.drifts.to(action.device)[action])


class Velocities:
    """Speed forward, speed to the left and yaw rate; the height is kept if there is no climb."""

    modes: Modes = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.POSITION)

    def __init__(self, settings: ActionSettings) -> None:
        self.actions = ContinuousActions.of(settings)
        if settings.climb_speed > 0:
            self.modes = (*self.modes[:3], Mode.VELOCITY)

    def goals(self, body: FlightState, action: Tensor) -> FlightGoals:
        """Return the goals until the next action. `action`: (num_envs, 3), or 4 with climb."""
        rates = self.actions.to_rates(action)
        height = body.reference[:, rates.shape[-1] :]
        return FlightGoals(self.modes, torch.cat([rates, height], -1))
