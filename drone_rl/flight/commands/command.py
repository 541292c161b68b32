"""Commands: goals for each control period until the command is complete."""

import abc
import math
from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

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
    """A command that a batch of drones starts at the same time. An instance is used once."""

    limit: float = math.inf
    """Seconds after which the command ends."""
    succeeds_at_limit: bool = False
    """Whether running until the limit is success, as for a movement of given duration."""

    @abc.abstractmethod
    def goals(self, body: FlightState) -> FlightGoals:
        """Return the goals for the next control period."""

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones have completed the command. Shape: (num_envs,), bool.

        Called once in each control period, so that a command may count periods.
        """
        return torch.zeros(len(body), dtype=torch.bool)

    def rest(self, body: FlightState) -> Tensor | None:
        """Return the pose to hold after success, or None if the command sets no position.

        Shape: (num_envs, 4), as in `FlightState.reference`.
        """
        del body
        return None


def goals_of(
    body: FlightState,
    modes: Modes,
    x: float | Tensor,
    y: float | Tensor,
    heading: float | Tensor,
    z: float | Tensor,
) -> FlightGoals:
    """Build goals from scalars (for all drones) or tensors of shape (num_envs,).

    A value is what its mode says: a position, velocity, angle or rate.
    """
    goals, count = (x, y, heading, z), len(body)
    if count == 1 and body.numbers.device.type == "cpu":
        row = np.array([[float(value) for value in goals]])
        return FlightGoals(modes, torch.from_numpy(row))  # a tenth of the time, in each period
    values = (torch.as_tensor(value, dtype=torch.float64) for value in goals)
    return FlightGoals(modes, torch.stack([value.expand(count) for value in values], -1))


def hold(reference: Tensor) -> FlightGoals:
    """Return goals that hold a pose. Shape: (num_envs, 4), as in `FlightState.reference`."""
    return FlightGoals(HOLD, reference)


def all_rotors(thrust: float) -> FlightGoals:
    """Return goals for one drone whose rotors all have this fraction of full thrust."""
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
        self.reference, self.limit = body.reference.clone(), duration

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        del body
        return hold(self.reference)

    def rest(self, body: FlightState) -> Tensor:
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
        self.heading, self.margin = heading, margin
        self.reference[:, 2] = heading

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones have the heading and do not turn."""
        missing = self.heading - body.heading
        missing = torch.atan2(missing.sin(), missing.cos())
        is_still = body.angular_velocity[:, 2].abs() <= _STILL
        return (missing.abs() <= self.margin) & is_still


class RotateByCommand(Hover):
    """Turns at a rate, holding the position."""

    def __init__(self, body: FlightState, rate: float, duration: float) -> None:
        """Take the rate in radians per second, to the left, and the duration in seconds."""
        super().__init__(body, duration)
        self.rate = rate

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        x, y, _, z = self.reference.unbind(-1)
        modes = (Mode.POSITION, Mode.POSITION, Mode.RATE, Mode.POSITION)
        return goals_of(body, modes, x, y, self.rate, z)

    def rest(self, body: FlightState) -> Tensor:
        """Return the position with the heading that the drone has now."""
        after = self.reference.clone()
        after[:, 2] = body.heading
        return after


class Land(Command):
    """Descends at the reference position until the drone stands."""

    def __init__(self, body: FlightState, limit: float) -> None:
        """Take the state at the start and the time limit in seconds."""
        self.limit, self.reference = limit, body.reference.clone()
        self._stopped = torch.zeros(len(body), dtype=torch.int64)

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        x, y, heading, _ = self.reference.unbind(-1)
        modes = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.VELOCITY)
        return goals_of(body, modes, x, y, heading, -LANDING_SPEED)

    def is_complete(self, body: FlightState) -> Tensor:
        """Count periods without sinking; see `Command`."""
        is_still = body.velocity[:, 2].abs() <= _STOPPED
        self._stopped = torch.where(is_still, self._stopped + 1, 0)
        return self._stopped > _STOPPED_PERIODS


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
