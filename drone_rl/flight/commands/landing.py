"""Landing: down, slowly, until something carries the drone."""

import torch
from torch import Tensor

from drone_rl.flight.commands.command import Command, goals_of
from drone_rl.sim.dynamics import FlightState, Goals, Mode

LANDING_SPEED = 0.2
"""Metres a second."""
STOPPED = 0.05
"""Metres a second up to which a drone that should sink doesn't."""
_PERIODS = 10
"""For which it mustn't."""


class Land(Command):
    """Sinks where it is, or where it was last told to be if that was a place."""

    def __init__(self, limit: float, speed: float = LANDING_SPEED) -> None:
        """Takes seconds after which it has failed, and how fast to sink, metres a second."""
        self.limit, self.speed = limit, speed

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.reference = body.reference.clone()
        self.stopped = torch.zeros(len(body), dtype=torch.int64)

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        x, y, heading, _ = self.reference.unbind(-1)
        modes = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.VELOCITY)
        return goals_of(body, modes, x, y, heading, -self.speed)

    def is_complete(self, body: FlightState) -> Tensor:
        """Once it hasn't sunk for ten periods, each of which asks once."""
        is_still = body.velocity[:, 2].abs() <= STOPPED
        self.stopped = torch.where(is_still, self.stopped + 1, 0)
        return self.stopped > _PERIODS
