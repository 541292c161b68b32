"""Going home: over the place of take-off, and down there."""

from torch import Tensor

from drone_rl.flight.commands.along import AlongPath
from drone_rl.flight.commands.command import Command
from drone_rl.flight.commands.landing import Land
from drone_rl.sim.dynamics import FlightState, Goals


class GoHome(Command):
    """A path, and a landing once every drone has come to its end."""

    def __init__(self, path: AlongPath, landing: Land) -> None:
        """Takes both."""
        self.limit = path.limit + landing.limit
        self.path, self.landing = path, landing
        self.is_landing = False

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.path.begin(body)

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        return self.landing.goals(body) if self.is_landing else self.path.goals(body)

    def is_complete(self, body: FlightState) -> Tensor:
        """When landed."""
        if self.is_landing:
            return self.landing.is_complete(body)
        there = self.path.is_complete(body)
        if bool(there.all()):
            self.is_landing = True
            self.landing.begin(body)
            self.landing.reference[:] = self.path.rest(body)
        return there & False
