"""Staying at a place: hovering, and turning there."""

import torch
from torch import Tensor

from drone_rl.flight.commands.command import Command, goals_of, hold
from drone_rl.sim.dynamics import FlightState, Goals, Mode

_STILL = 0.01
"""Radians a second up to which a drone doesn't turn."""


class Hover(Command):
    """Stays where it is, or where it was last told to be if that was a place."""

    lasts = True

    def __init__(self, duration: float) -> None:
        """Takes how long, seconds."""
        self.limit = duration

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.reference = body.reference.clone()

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        del body
        return hold(self.reference)

    def rest(self, body: FlightState) -> Tensor:
        """The same place."""
        del body
        return self.reference


class RotateTo(Hover):
    """Turns to a heading, the shorter way round, and stays where it is."""

    lasts = False

    def __init__(self, heading: float, margin: float, limit: float) -> None:
        """Takes where to look.

        Args:
            heading: Radians to the left of the world's x.
            margin: Radians off at which it is done, once it no longer turns.
            limit: Seconds after which it has failed.
        """
        self.heading, self.margin, self.limit = heading, margin, limit

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        super().begin(body)
        self.reference[:, 2] = self.heading

    def is_complete(self, body: FlightState) -> Tensor:
        """Looking there, at rest."""
        missing = self.heading - body.heading
        missing = torch.atan2(missing.sin(), missing.cos())
        is_still = body.angular_velocity[:, 2].abs() <= _STILL
        return (missing.abs() <= self.margin) & is_still


class RotateBy(Hover):
    """Turns at a rate and stays where it is."""

    def __init__(self, rate: float, duration: float) -> None:
        """Takes how fast.

        Args:
            rate: Radians a second, to the left.
            duration: Seconds.
        """
        super().__init__(duration)
        self.rate = rate

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        x, y, _, z = self.reference.unbind(-1)
        modes = (Mode.POSITION, Mode.POSITION, Mode.RATE, Mode.POSITION)
        return goals_of(body, modes, x, y, self.rate, z)

    def rest(self, body: FlightState) -> Tensor:
        """The same place, looking where it has got to."""
        after = self.reference.clone()
        after[:, 2] = body.heading
        return after
