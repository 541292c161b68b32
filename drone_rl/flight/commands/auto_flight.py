"""Flying by itself (Table 2): taking off, landing, going home, hovering."""

import torch

from drone_rl.flight.commands import checks
from drone_rl.flight.commands.along import AlongPath, braking_time
from drone_rl.flight.commands.cockpit import Cockpit, limit_of
from drone_rl.flight.commands.errors import PilotError
from drone_rl.flight.commands.future import FlightFuture
from drone_rl.flight.commands.holding import Hover
from drone_rl.flight.commands.homing import GoHome
from drone_rl.flight.commands.landing import LANDING_SPEED, Land
from drone_rl.flight.commands.taking_off import TAKE_OFF_HEIGHT, TAKE_OFF_SPEED, TakeOff

MOVING = 0.05
"""Metres a second above which no drone takes off."""


class AutoFlight(Cockpit):
    """The commands that need no numbers; see `Pilot`."""

    def take_off(self, timeout: float | None = None, *, wait: bool = True) -> bool | FlightFuture:
        """Climbs 2 m, at 0.5 m/s.

        Raises:
            PilotError: It isn't armed, or moves.
        """
        self._needs_arms("take_off")
        if self._drone.speed > MOVING:
            raise PilotError(
                f"can't take off while moving at {self._drone.speed:.2g} m/s; wait until the drone "
                "stands still"
            )
        limit = limit_of(timeout, TAKE_OFF_HEIGHT, TAKE_OFF_SPEED)
        return self._tell("take_off", TakeOff(self._drone.body, limit), wait)

    def land(self, timeout: float | None = None, *, wait: bool = True) -> bool | FlightFuture:
        """Sinks at 0.2 m/s where it is, until it stands."""
        height = float(self._drone.body.position[0, 2])
        limit = limit_of(timeout, height, LANDING_SPEED)
        return self._fly("land", Land(limit), wait)

    def go_home(
        self, timeout: float | None = None, *, speed: float = TAKE_OFF_SPEED, wait: bool = True
    ) -> bool | FlightFuture:
        """Flies over the place where it was put down, at its present height, and lands there."""
        pace = checks.speed(speed)
        position, home = self._drone.body.position, self._drone.home
        over = torch.stack([home[0], home[1], position[0, 2]])[None, None]
        away, height = float((over[0] - position).norm()), float(position[0, 2])
        limit, braking = limit_of(timeout, away, pace), braking_time(self.settings)
        path = AlongPath(over, pace, limit, braking=braking)
        land = Land(limit_of(timeout, height, LANDING_SPEED))
        command = GoHome(path, land)
        if timeout is not None:
            command.limit = path.limit
        return self._fly("go_home", command, wait)

    def hover(self, duration: float = 0.0, *, wait: bool = True) -> bool | FlightFuture:
        """Stays where it is, for some seconds and after."""
        return self._fly("hover", Hover(checks.duration(duration)), wait)
