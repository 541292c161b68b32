"""Goals of the flight controller, axis by axis as in SimpleFlight, and the goals of actions."""

import dataclasses
import enum

import torch
from torch import Tensor

from drone_rl.config import ActionSettings
from drone_rl.sim.actions import DIRECTIONS, MOVES
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


Modes = tuple[Mode, Mode, Mode, Mode]


@dataclasses.dataclass(frozen=True)
class FlightGoals:
    """Goals of drones' controllers, all in the same modes."""

    modes: Modes
    """Of x (or roll), y (or pitch), heading and height. The first two are the same; `ROTOR` is the
    mode of all four or of none; headings have no other mode than `RATE` and `ANGLE`."""
    values: Tensor  # (num_envs, 4) float64
    drift: Tensor | None = None  # (num_envs, 4) float64
    """Rate of change of positions and headings per second; 0 by default."""

    @property
    def drifts(self) -> Tensor:
        """`drift`, zeros if it is None."""
        return torch.zeros_like(self.values) if self.drift is None else self.drift

    def reference_after(self, seconds: float, body: FlightState) -> Tensor:
        """Return `FlightState.reference` after `seconds` of a command; `body` has the drones."""
        has_target = [mode is Mode.POSITION for mode in self.modes]
        has_target[HEADING] = self.modes[HEADING] is Mode.ANGLE
        target = self.values + seconds * self.drifts
        return torch.where(torch.tensor(has_target), target, body.settled().reference)


def rotor_goals(rotors: Tensor) -> FlightGoals:
    """Return goals that set rotors directly. Shape: (num_envs, 4)."""
    return FlightGoals((Mode.ROTOR, Mode.ROTOR, Mode.ROTOR, Mode.ROTOR), rotors)


class Moves:
    """The chapter's moves: each moves the target position at a constant speed.

    At the start of a move, the target is at most the lead away from the drone, along x and along y.
    """

    MODES = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
    actions = MOVES

    def __init__(self, settings: ActionSettings) -> None:
        self.modes: Modes = self.MODES
        self.lead = settings.move_lead
        self.drifts = torch.zeros(len(DIRECTIONS), 4, dtype=torch.float64)
        self.drifts[:, :2] = torch.tensor(DIRECTIONS, dtype=torch.float64)[:, :2]
        self.drifts *= settings.move_speed
        """Speed of the target for each move, metres a second. Shape: (moves, 4)."""

    def goals(self, body: FlightState, action: Tensor) -> FlightGoals:
        """Return the goals until the next action. `action`: (num_envs,)."""
        place = body.position[:, :2]
        wanted = body.reference.clone()
        wanted[:, :2] = place + (wanted[:, :2] - place).clamp(-self.lead, self.lead)
        return FlightGoals(self.MODES, wanted, self.drifts.to(action.device)[action])


class Velocities:
    """Speed forward, speed to the left and yaw rate; the height is kept."""

    MODES = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.POSITION)

    def __init__(self, settings: ActionSettings) -> None:
        self.actions = ContinuousActions.of(settings)
        self.modes: Modes = self.MODES

    def goals(self, body: FlightState, action: Tensor) -> FlightGoals:
        """Return the goals until the next action. `action`: (num_envs, 3)."""
        height = body.reference[:, 3:]
        return FlightGoals(self.modes, torch.cat([self.actions.to_rates(action), height], -1))
