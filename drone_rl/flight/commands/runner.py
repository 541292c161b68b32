"""Lets simulated time pass for a drone: the running command, then hovering."""

from torch import Tensor

from drone_rl.flight.commands.command import Command, hold
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.future import FlightFuture
from drone_rl.flight.commands.homing import GoHome
from drone_rl.flight.commands.landing import Land
from drone_rl.sim.dynamics import Goals

COASTING = 0.06
"""Seconds without a goal after which a drone stays where it then is."""


class Runner:
    """Has at most one command at a time; a new one takes its place."""

    def __init__(self, drone: Drone) -> None:
        """Takes the drone."""
        self.drone = drone
        self.running: FlightFuture | None = None
        self._goals: Goals | None = None
        """Of the present period, if anything is asked for."""
        self._left = 0
        """Ticks of it."""
        self._coasting = 0
        """Ticks for which the last goals still hold, after a command that named no place."""
        self._place: Tensor | None = None
        """Where the drone stays when nothing else is asked for."""

    def start(self, name: str, command: Command) -> FlightFuture:
        """Tells the drone something else from now on.

        Args:
            name: For people.
            command: What.
        """
        self.cancel()
        future = FlightFuture(name, command, self.finish)
        command.begin(self.drone.body)
        self.running, self._left = future, 0
        if command.limit <= 0.0:
            self._end(command.lasts)
        return future

    def cancel(self) -> None:
        """Ends the running command, if there is one."""
        if self.running is not None:
            self.running.cancel()
            self._end(None)

    def finish(self, future: FlightFuture) -> None:
        """Lets time pass until a command is done."""
        while not future.done:
            self.advance(self._left or self.drone.period)

    def advance(self, ticks: int) -> None:
        """Lets time pass."""
        while ticks > 0:
            if self._left == 0:
                self._goals, self._left = self._decide(), self.drone.period
            now = min(ticks, self._left)
            self.drone.fly(self._goals, now)
            ticks, self._left = ticks - now, self._left - now
            self._coasting = max(0, self._coasting - now)
            if self.running is not None:
                self.running.elapsed += now * self.drone.tick
                if self._left == 0:
                    self._check(self.running)

    def switched_off(self) -> None:
        """Forgets all that was asked for."""
        self.cancel()
        self._place, self._coasting, self._left = None, 0, 0

    def _decide(self) -> Goals | None:
        """Goals for the next period."""
        drone = self.drone
        if self.running is not None:
            return self.running.command.goals(drone.body)
        if self._coasting > 0:
            return self._goals
        if not drone.is_flying:
            self._place = None
            return None
        if self._place is None:
            self._place = drone.here()
        return hold(self._place)

    def _check(self, future: FlightFuture) -> None:
        """Sees whether a command is over."""
        command = future.command
        if self.drone.is_lost:
            self._end(False)
        elif bool(command.is_complete(self.drone.body)[0]):
            self._end(True)
        elif future.elapsed >= command.limit - 1e-9:
            self._end(command.lasts)

    def _end(self, success: bool | None) -> None:
        """Notes how the running command went, None if it was cancelled; what comes after it."""
        future, self.running = self.running, None
        assert future is not None
        command, self._left = future.command, 0
        self._place = None
        self._coasting = self.drone.ticks_of(COASTING)
        if success is None:
            return
        future.finish(success)
        if success:
            self._place = command.rest(self.drone.body)
        if success and isinstance(command, Land | GoHome):
            self.drone.settle()
        if self._place is not None:
            self.drone.body.reference[:] = self._place
        if self._place is not None or not self.drone.is_flying:
            self._coasting = 0
