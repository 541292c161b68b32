"""Commands: goals for each control period until the command is complete."""

import abc
import math
from collections.abc import Callable, Sequence

import numpy as np
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode
from drone_rl.sim.dynamics.control import Modes, rotor_goals
from drone_rl.utils.errors import InputError

PERIOD = 0.02
"""Least control period, seconds."""
ACCURACY = 0.5
"""Distance in metres within which a position counts as reached."""
HOLD = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
"""Goal modes of a drone that holds its position."""
LANDING_SPEED = 0.2
"""Metres per second."""
_STOPPED = 0.05
"""Vertical speed up to which a landing drone counts as standing, m/s."""
_STOPPED_PERIODS = 10
"""A landing is complete after more than this many control periods without sinking."""
_STILL = 0.01
"""Yaw rate up to which a drone does not turn, radians per second."""


class PilotError(InputError):
    """A command that the drone's state does not allow, such as taking off while disarmed."""


class Command(abc.ABC):
    """A command of one drone. An instance is used once.

    Poses to hold are x, y, heading and z, as in `FlightState.reference`.
    """

    limit: float = math.inf
    """Seconds after which the command ends."""
    succeeds_at_limit: bool = False
    """Whether running until the limit is success, as for a movement of given duration."""

    @abc.abstractmethod
    def goals(self, body: FlightState) -> FlightGoals:
        """Return the goals for the next control period."""

    def is_complete(self, body: FlightState) -> bool:
        """Return whether the command is complete.

        Called once in each control period, so that a command may count periods.
        """
        return False

    def rest(self, body: FlightState) -> list[float] | None:
        """Return the pose to hold after success, or None if the command sets no position."""
        del body
        return None


def goals_of(modes: Modes, *values: float, climb: float = 0.0) -> FlightGoals:
    """Build the goals of one drone: x, y, heading and z.

    A value is what its mode says: a position, velocity, angle or rate. A height changes by `climb`,
    metres per second.
    """
    drift = torch.tensor([[0.0, 0.0, 0.0, climb]], dtype=torch.float64) if climb else None
    return FlightGoals(modes, torch.from_numpy(np.array([values], dtype=np.float64)), drift)


def hold(pose: Sequence[float]) -> FlightGoals:
    """Return goals that hold a pose; see `Command`."""
    return goals_of(HOLD, *pose)


def all_rotors(thrust: float) -> FlightGoals:
    """Return goals of rotors that all have this fraction of full thrust."""
    return rotor_goals(torch.full((1, 4), thrust, dtype=torch.float64))


class TimedCommand(Command):
    """Sets goals for some seconds, and no position to hold afterwards."""

    succeeds_at_limit = True

    def __init__(self, goals: Callable[[FlightState], FlightGoals], duration: float) -> None:
        """Take the goals of each control period, and the duration in seconds."""
        self._goals, self.limit = goals, duration

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        return self._goals(body)


class Hover(Command):
    """Holds the reference pose."""

    succeeds_at_limit = True

    def __init__(self, body: FlightState, duration: float) -> None:
        """Take the state at the start and the duration in seconds."""
        self.reference, self.limit = body.reference[0].tolist(), duration

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        del body
        return hold(self.reference)

    def rest(self, body: FlightState) -> list[float] | None:
        """See `Command`."""
        del body
        return self.reference


class RotateToCommand(Hover):
    """Turns to a heading the shorter way round, holding the position."""

    succeeds_at_limit = False

    def __init__(self, body: FlightState, heading: float, margin: float, limit: float) -> None:
        """Take the state at the start, heading and margin in radians, and time limit in seconds.

        The heading is to the left of the world's x axis. The command is complete at rest with a
        heading error of at most the margin.
        """
        super().__init__(body, limit)
        self.reference[2], self.margin = heading, margin

    def is_complete(self, body: FlightState) -> bool:
        """Return whether the drone has the heading and does not turn."""
        missing = math.remainder(self.reference[2] - float(body.heading[0]), math.tau)
        is_still = abs(float(body.angular_velocity[0, 2])) <= _STILL
        return abs(missing) <= self.margin and is_still


class RotateByCommand(Hover):
    """Turns at a rate, holding the position."""

    def __init__(self, body: FlightState, rate: float, duration: float) -> None:
        """Take the rate in radians per second, to the left, and the duration in seconds."""
        super().__init__(body, duration)
        self.rate = rate

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        x, y, _, z = self.reference
        return goals_of(
            (Mode.POSITION, Mode.POSITION, Mode.RATE, Mode.POSITION), x, y, self.rate, z
        )

    def rest(self, body: FlightState) -> list[float]:
        """Return the position with the heading that the drone has now."""
        x, y, _, z = self.reference
        return [x, y, float(body.heading[0]), z]


class Land(Hover):
    """Descends at the reference position until the drone stands."""

    succeeds_at_limit = False

    def __init__(self, body: FlightState, limit: float, pose: list[float] | None = None) -> None:
        """Take the state at the start, the time limit in seconds, and a pose other than its own."""
        super().__init__(body, limit)
        self.reference = pose or self.reference
        self._stopped = 0

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        modes = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.VELOCITY)
        return goals_of(modes, *self.reference[:3], -LANDING_SPEED)

    def is_complete(self, body: FlightState) -> bool:
        """Count periods without sinking; see `Command`."""
        is_still = abs(float(body.velocity[0, 2])) <= _STOPPED
        self._stopped = self._stopped + 1 if is_still else 0
        return self._stopped > _STOPPED_PERIODS

    def rest(self, body: FlightState) -> None:
        """See `Command`."""


class FlightFuture:
    """A running or finished command. It advances only while simulated time passes."""

    def __init__(self, name: str, command: Command, wait: Callable[["FlightFuture"], None]) -> None:
        """Take the name for messages; `wait` advances simulated time until the command is done."""
        self.name, self.command = name, command
        self.elapsed = 0.0
        """Simulated seconds since the command started."""
        self._wait = wait
        self._success: bool | None = None
        self.cancelled = False
        """Whether the command was cancelled, such as by another one, before it ended."""

    @property
    def done(self) -> bool:
        """Whether the command has ended, successfully or not."""
        return self._success is not None

    def result(self) -> bool:
        """Advance simulated time until the command ends; return whether it succeeded in time."""
        if not self.done:
            self._wait(self)
        return bool(self._success)

    def finish(self, success: bool) -> None:
        """Mark the command as ended."""
        self._success = success

    def cancel(self) -> None:
        """Mark the command as cancelled, unless it has ended."""
        if not self.done:
            self.cancelled, self._success = True, False

    def __repr__(self) -> str:
        """Return the name and the status."""
        if self.cancelled:
            return f"<{self.name}: cancelled after {self.elapsed:.2f} s>"
        if not self.done:
            return f"<{self.name}: running for {self.elapsed:.2f} s>"
        return f"<{self.name}: {'done' if self._success else 'failed'} in {self.elapsed:.2f} s>"


def period_ticks(settings: DynamicsSettings) -> int:
    """Return the physics ticks of one control period: the fewest that last `PERIOD`."""
    return max(1, math.ceil(PERIOD / settings.tick - 1e-9))
