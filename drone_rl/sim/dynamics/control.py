"""Goals of the flight controller, axis by axis as in SimpleFlight, and the goals of actions."""

import dataclasses
import enum

import torch
from torch import Tensor

from drone_rl.config import ActionSettings
from drone_rl.sim.actions import DIRECTIONS, MOVES
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics.state import FlightState
from drone_rl.utils.errors import InputError

X, Y, HEADING, Z = range(4)


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


_SIDEWAYS = (Mode.RATE, Mode.ANGLE, Mode.VELOCITY, Mode.HEADING_VELOCITY, Mode.POSITION, Mode.ROTOR)
ALLOWED = (
    _SIDEWAYS,
    _SIDEWAYS,
    (Mode.RATE, Mode.ANGLE, Mode.ROTOR),
    (Mode.THROTTLE, Mode.VELOCITY, Mode.POSITION, Mode.ROTOR),
)
"""Modes of each axis."""

Modes = tuple[Mode, Mode, Mode, Mode]


@dataclasses.dataclass(frozen=True)
class Goals:
    """Goals of drones' controllers, all in the same modes; invalid ones raise an `InputError`."""

    modes: Modes
    """Of x (or roll), y (or pitch), heading and height."""
    values: Tensor  # (num_envs, 4) float64
    drift: Tensor | None = None  # (num_envs, 4) float64
    """Rate of change of positions and headings per second; 0 by default."""

    def __post_init__(self) -> None:
        for axis, (mode, allowed) in enumerate(zip(self.modes, ALLOWED, strict=True)):
            if mode not in allowed:
                known = ", ".join(m.name.lower() for m in allowed)
                raise InputError(f"modes[{axis}]={mode!r} is unknown; give one of: {known}")
        if 0 < self.modes.count(Mode.ROTOR) < len(ALLOWED):
            raise InputError(f"modes={self._names}: rotor is for all axes; give it to all or none")
        if self.modes[X] != self.modes[Y]:
            raise InputError(f"modes={self._names}: the first two go together; give both the same")
        if self.values.dim() != 2 or self.values.shape[1] != len(ALLOWED):
            raise InputError(
                f"goals of shape {tuple(self.values.shape)} are not (num_envs, 4); give a number "
                "for each axis"
            )
        if self.drift is not None and self.drift.shape != self.values.shape:
            raise InputError(
                f"drift of shape {tuple(self.drift.shape)} is not that of the goals; give "
                f"{tuple(self.values.shape)}"
            )

    @property
    def _names(self) -> str:
        return ", ".join(mode.name.lower() for mode in self.modes)

    @property
    def drifts(self) -> Tensor:
        """`drift`, zeros if it is None."""
        return torch.zeros_like(self.values) if self.drift is None else self.drift

    def reference_after(self, seconds: float, body: FlightState) -> Tensor:
        """Return `FlightState.reference` after `seconds` of a command; `body` has the drones."""
        has_target = [mode is Mode.POSITION for mode in self.modes]
        has_target[HEADING] = self.modes[HEADING] is Mode.ANGLE
        there = self.values + seconds * self.drifts
        return torch.where(torch.tensor(has_target), there, body.settled().reference)


def rotor_goals(rotors: Tensor) -> Goals:
    """Return goals that set rotors directly. Shape: (num_envs, 4)."""
    return Goals((Mode.ROTOR, Mode.ROTOR, Mode.ROTOR, Mode.ROTOR), rotors)


class Moves:
    """The chapter's moves: each moves the target position at a constant speed.

    At the start of a move, the target is at most the lead away from the drone, along x and along y.
    """

    MODES = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
    actions = MOVES

    def __init__(self, settings: ActionSettings) -> None:
        self.lead = settings.move_lead
        self.drifts = torch.zeros(len(DIRECTIONS), 4, dtype=torch.float64)
        self.drifts[:, :2] = torch.tensor(DIRECTIONS, dtype=torch.float64)[:, :2]
        self.drifts *= settings.move_speed
        """Speed of the target for each move, metres a second. Shape: (moves, 4)."""

    def goals(self, body: FlightState, action: Tensor) -> Goals:
        """Return the goals until the next action. `action`: (num_envs,)."""
        place = body.position[:, :2]
        wanted = body.reference.clone()
        wanted[:, :2] = place + (wanted[:, :2] - place).clamp(-self.lead, self.lead)
        return Goals(self.MODES, wanted, self.drifts.to(action.device)[action])


class Velocities:
    """Speed forward, speed to the left and yaw rate; the height is kept."""

    MODES = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.POSITION)

    def __init__(self, settings: ActionSettings) -> None:
        self.actions = ContinuousActions.of(settings)

    def goals(self, body: FlightState, action: Tensor) -> Goals:
        """Return the goals until the next action. `action`: (num_envs, 3)."""
        height = body.reference[:, 3:]
        return Goals(self.MODES, torch.cat([self.actions.to_rates(action), height], -1))
