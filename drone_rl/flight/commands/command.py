"""The command interface: goals for each control period until the command is complete."""

import abc
import dataclasses
import math
from collections.abc import Callable

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import FlightState, Goals, Mode, Obstacles, Quadrotor
from drone_rl.sim.dynamics.control import Modes
from drone_rl.utils.errors import InputError

PERIOD = 0.02
"""Control period in seconds, at least."""
ACCURACY = 0.5
"""Distance in metres within which a position counts as reached."""
HOLD = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
"""Goal modes of a drone that holds its position."""


class PilotError(InputError):
    """A command that the drone's state does not allow, such as taking off while disarmed."""


class Command(abc.ABC):
    """A command for a batch of drones. An instance is used once."""

    limit: float = math.inf
    """Seconds after which the command ends."""
    succeeds_at_limit: bool = False
    """Whether running until the limit is success, as for a movement of given duration."""

    def begin(self, body: FlightState) -> None:
        """Record the state at the start of the command."""
        del body

    @abc.abstractmethod
    def goals(self, body: FlightState) -> Goals:
        """Return the goals for the next control period."""

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones have completed the command. Shape: (num_worlds,), bool."""
        return torch.zeros(len(body), dtype=torch.bool)

    def rest(self, body: FlightState) -> Tensor | None:
        """Return the pose to hold after success, or None if the command sets no position.

        Shape: (num_worlds, 4), as in `FlightState.reference`.
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
) -> Goals:
    """Build goals from scalars (for all drones) or tensors of shape (num_worlds,)."""
    columns = [
        torch.as_tensor(v, dtype=torch.float64).expand(len(body)) for v in (x, y, heading, z)
    ]
    return Goals(modes, torch.stack(columns, -1))


def hold(reference: Tensor) -> Goals:
    """Return goals that hold a pose. Shape: (num_worlds, 4), as in `FlightState.reference`."""
    return Goals(HOLD, reference)


class FlightFuture:
    """A running or finished command. It advances only while simulated time passes."""

    def __init__(self, name: str, command: Command, wait: Callable[["FlightFuture"], None]) -> None:
        """Create a future.

        Args:
            name: Name for messages.
            command: The command.
            wait: Advances simulated time until this future is done.
        """
        self.name, self.command = name, command
        self.elapsed = 0.0
        """Simulated seconds since the command started."""
        self._wait = wait
        self._success: bool | None = None
        self._is_cancelled = False

    @property
    def done(self) -> bool:
        """Whether the command has ended, successfully or not."""
        return self._success is not None

    @property
    def cancelled(self) -> bool:
        """Whether another command replaced this one."""
        return self._is_cancelled

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
            self._is_cancelled, self._success = True, False

    def __repr__(self) -> str:
        """Return the name and the status."""
        if self.cancelled:
            return f"<{self.name}: cancelled after {self.elapsed:.2f} s>"
        if not self.done:
            return f"<{self.name}: running for {self.elapsed:.2f} s>"
        return f"<{self.name}: {'done' if self._success else 'failed'} in {self.elapsed:.2f} s>"


@dataclasses.dataclass(frozen=True)
class FlightRecord:
    """States of `num_worlds` drones while they run one command."""

    times: Tensor  # (T,) float64
    """Seconds since the start."""
    states: list[FlightState]
    """State at each time."""
    done: Tensor  # (num_worlds,) int64
    """Index of the first time at which each drone was complete; T if it never was."""

    @property
    def positions(self) -> Tensor:
        """Metres. Shape: (T, num_worlds, 3)."""
        return torch.stack([state.position for state in self.states])


def period_ticks(settings: DynamicsSettings) -> int:
    """Return the physics ticks of one control period: the fewest that last `PERIOD`."""
    return max(1, math.ceil(PERIOD / settings.tick - 1e-9))


def fly_command(
    quadrotor: Quadrotor,
    body: FlightState,
    command: Command,
    seconds: float,
    obstacles: Obstacles | None = None,
) -> FlightRecord:
    """Run one command until all drones are complete; drones that are complete continue.

    Args:
        quadrotor: Vehicle dynamics.
        body: Initial state.
        command: The command.
        seconds: Maximum duration.
        obstacles: Obstacles to collide with.
    """
    ticks = period_ticks(quadrotor.settings)
    step = ticks * quadrotor.settings.tick
    states = [body]
    command.begin(body)
    done = torch.full((len(body),), -1)
    most = int(min(seconds, command.limit) / step)
    while len(states) <= most and bool((done < 0).any()):
        body = quadrotor.fly(body, command.goals(body), ticks, obstacles)
        done = torch.where((done < 0) & command.is_complete(body), len(states), done)
        states.append(body)
    done = torch.where(done < 0, len(states), done)
    return FlightRecord(torch.arange(len(states), dtype=torch.float64) * step, states, done)
