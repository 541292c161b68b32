"""Flying by angles, by rates, or rotor by rotor, with a height or with a throttle."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.flight.commands.command import Command, goals_of
from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.sim.dynamics.control import Modes, rotor_goals


@dataclasses.dataclass(frozen=True)
class Height:
    """To be held."""

    meters: float
    mode = Mode.POSITION

    @property
    def goal(self) -> float:
        """Of the fourth axis."""
        return self.meters


@dataclasses.dataclass(frozen=True)
class Throttle:
    """Given to the rotors as it is."""

    share: float
    """Of all thrust, 0 to 1."""
    mode = Mode.THROTTLE

    @property
    def goal(self) -> float:
        """Of the fourth axis."""
        return self.share


Lift = Height | Throttle
"""What holds a drone up."""


class ByAngle(Command):
    """Rolls and pitches. Radians: to the right, and nose down."""

    lasts = True

    def __init__(
        self,
        roll: float,
        pitch: float,
        lift: Lift,
        duration: float,
        *,
        yaw: float | None = None,
        yaw_rate: float | None = None,
    ) -> None:
        """Takes the angles.

        Args:
            roll: Right side down.
            pitch: Nose down.
            lift: Height or throttle.
            duration: Seconds.
            yaw: Heading, to the left of the world's x; as it is by default.
            yaw_rate: In place of `yaw`, radians a second to the left.
        """
        self.limit = duration
        self.roll, self.pitch, self.lift = roll, pitch, lift
        self._yaw, self._yaw_rate = yaw, yaw_rate

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.heading = body.heading.clone()
        if self._yaw is not None:
            self.heading[:] = self._yaw

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        is_rate = self._yaw_rate is not None
        turn = self._yaw_rate if self._yaw_rate is not None else self.heading
        modes: Modes = (
            Mode.ANGLE, Mode.ANGLE, Mode.RATE if is_rate else Mode.ANGLE, self.lift.mode
        )  # fmt: skip
        return goals_of(body, modes, self.roll, self.pitch, turn, self.lift.goal)


class ByRates(Command):
    """Turns about its three axes. Radians a second: right side down, nose down, to the left."""

    lasts = True

    def __init__(self, rates: tuple[float, float, float], lift: Lift, duration: float) -> None:
        """Takes the rates about x, y and z, height or throttle, and seconds."""
        self.limit, self.rates, self.lift = duration, rates, lift

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        modes: Modes = (Mode.RATE, Mode.RATE, Mode.RATE, self.lift.mode)
        return goals_of(body, modes, *self.rates, self.lift.goal)


class ByRotors(Command):
    """Sets every rotor, without any controller."""

    lasts = True

    def __init__(self, shares: tuple[float, float, float, float], duration: float) -> None:
        """Takes shares of the most thrust of each rotor, in the order of `FlightState.rotors`."""
        self.limit, self.shares = duration, shares

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        return rotor_goals(_rows(body, self.shares))


def _rows(body: FlightState, numbers: tuple[float, ...]) -> Tensor:
    return torch.tensor(numbers, dtype=torch.float64).repeat(len(body), 1)
