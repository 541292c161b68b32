"""Commands that move a drone: landing, hovering, angles, rates, velocities, sticks."""

import dataclasses
import enum
import math
from collections.abc import Callable

import torch
from torch import Tensor

from drone_rl.flight.commands.checks import real
from drone_rl.flight.commands.command import ACCURACY, Command, goals_of, hold
from drone_rl.flight.commands.path_following import PathCommand
from drone_rl.flight.commands.yaw import YawControl
from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.sim.dynamics.control import Modes, rotor_goals
from drone_rl.utils.errors import InputError

LANDING_SPEED = 0.2
"""Metres per second."""
YAW_AT_FULL_STICK = 100.0
"""Degrees (per second) that the yaw stick adds to the yaw mode."""
_STOPPED = 0.05
"""Vertical speed up to which a landing drone counts as standing, m/s."""
_STOPPED_PERIODS = 10
"""Control periods without sinking after which a landing is complete."""
_STILL = 0.01
"""Yaw rate up to which a drone does not turn, radians per second."""


class Land(Command):
    """Descends at the reference position until the drone stands."""

    def __init__(self, limit: float, speed: float = LANDING_SPEED) -> None:
        """Take the time limit in seconds and the sink rate in m/s."""
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
        """Count periods without sinking; must be called once per period."""
        is_still = body.velocity[:, 2].abs() <= _STOPPED
        self.stopped = torch.where(is_still, self.stopped + 1, 0)
        return self.stopped > _STOPPED_PERIODS


class GoHomeCommand(Command):
    """Follows a path and lands once every drone has reached its end."""

    def __init__(self, path: PathCommand, landing: Land) -> None:
        """Take both parts."""
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
        """Return which drones have landed; switch to landing at the end of the path."""
        if self.is_landing:
            return self.landing.is_complete(body)
        there = self.path.is_complete(body)
        if bool(there.all()):
            self.is_landing = True
            self.landing.begin(body)
            self.landing.reference[:] = self.path.rest(body)
        return there & False


class Hover(Command):
    """Holds the reference pose."""

    succeeds_at_limit = True

    def __init__(self, duration: float) -> None:
        """Take the duration in seconds."""
        self.limit = duration

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.reference = body.reference.clone()

    def goals(self, body: FlightState) -> Goals:
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

    def __init__(self, heading: float, margin: float, limit: float) -> None:
        """Create the command.

        Args:
            heading: Radians to the left of the world's x axis.
            margin: Heading error in radians at which the command is complete, at rest.
            limit: Seconds after which it fails.
        """
        self.heading, self.margin, self.limit = heading, margin, limit

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        super().begin(body)
        self.reference[:, 2] = self.heading

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones have the heading and do not turn."""
        missing = self.heading - body.heading
        missing = torch.atan2(missing.sin(), missing.cos())
        is_still = body.angular_velocity[:, 2].abs() <= _STILL
        return (missing.abs() <= self.margin) & is_still


class RotateByCommand(Hover):
    """Turns at a rate, holding the position."""

    def __init__(self, rate: float, duration: float) -> None:
        """Take the rate in radians per second, to the left, and the duration in seconds."""
        super().__init__(duration)
        self.rate = rate

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        x, y, _, z = self.reference.unbind(-1)
        modes = (Mode.POSITION, Mode.POSITION, Mode.RATE, Mode.POSITION)
        return goals_of(body, modes, x, y, self.rate, z)

    def rest(self, body: FlightState) -> Tensor:
        """Return the position with the heading that the drone has now."""
        after = self.reference.clone()
        after[:, 2] = body.heading
        return after


@dataclasses.dataclass(frozen=True)
class Height:
    """Vertical goal: a height to hold, metres."""

    goal: float
    mode = Mode.POSITION


@dataclasses.dataclass(frozen=True)
class Throttle:
    """Vertical goal: a fraction of the maximum thrust, 0 to 1."""

    goal: float
    mode = Mode.THROTTLE


Lift = Height | Throttle
"""The fourth goal of a command by angles or rates."""


class AngleCommand(Command):
    """Holds roll and pitch. Radians, positive with the right side down and the nose down."""

    succeeds_at_limit = True

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
        """Create the command.

        Args:
            roll: Right side down.
            pitch: Nose down.
            lift: Height or throttle.
            duration: Seconds.
            yaw: Heading, to the left of the world's x axis; unchanged by default.
            yaw_rate: Yaw rate in place of `yaw`, radians per second to the left.
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
        turn, mode = self.heading, Mode.ANGLE
        if self._yaw_rate is not None:
            turn, mode = self._yaw_rate, Mode.RATE
        modes: Modes = (Mode.ANGLE, Mode.ANGLE, mode, self.lift.mode)
        return goals_of(body, modes, self.roll, self.pitch, turn, self.lift.goal)


class RateCommand(Command):
    """Holds body rates, radians per second: right side down, nose down, to the left."""

    succeeds_at_limit = True

    def __init__(self, rates: tuple[float, float, float], lift: Lift, duration: float) -> None:
        """Take the rates about x, y and z, height or throttle, and the duration in seconds."""
        self.limit, self.rates, self.lift = duration, rates, lift

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        modes: Modes = (Mode.RATE, Mode.RATE, Mode.RATE, self.lift.mode)
        return goals_of(body, modes, *self.rates, self.lift.goal)


class RotorCommand(Command):
    """Sets the rotors directly, without a controller."""

    succeeds_at_limit = True

    def __init__(self, shares: tuple[float, float, float, float], duration: float) -> None:
        """Take fractions of each rotor's maximum thrust, in the order of `FlightState.rotors`."""
        self.limit, self.shares = duration, shares

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        return rotor_goals(torch.tensor(self.shares, dtype=torch.float64).repeat(len(body), 1))


class Frame(enum.StrEnum):
    """The frame in which a velocity is given."""

    WORLD = "world"
    """The world's x and y axes."""
    BODY = "body"
    """x forward and y left of the drone; turns with it."""


def parse_frame(given: str) -> Frame:
    """Return a frame by name.

    Raises:
        InputError: The name is unknown.
    """
    try:
        return Frame(given)
    except ValueError as error:
        raise InputError(f"frame={given!r} is unknown; give one of: {', '.join(Frame)}") from error


class VelocityCommand(Command):
    """Holds a horizontal velocity and a climb rate or height."""

    succeeds_at_limit = True

    def __init__(
        self,
        velocity: tuple[float, float],
        duration: float,
        *,
        climb: float = 0.0,
        z: float | None = None,
        frame: Frame = Frame.WORLD,
        yaw_control: YawControl | None = None,
    ) -> None:
        """Create the command.

        Args:
            velocity: Along x and y, metres per second.
            duration: Seconds.
            climb: Metres per second, upward.
            z: Height to hold in place of `climb`, metres.
            frame: Frame of `velocity`.
            yaw_control: Heading control.

        Raises:
            InputError: `Frame.BODY` is combined with `Drivetrain.FORWARD_ONLY`.
        """
        self.limit, self.velocity, self.climb, self.z = duration, velocity, climb, z
        self.frame, self.yaw_control = frame, yaw_control or YawControl()
        if frame == Frame.BODY and self.yaw_control.is_forward:
            raise InputError(
                "frame=body turns with the drone and can't be combined with "
                "drivetrain=forward_only; give frame=world, or max_degree_of_freedom"
            )

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.yaw_control.begin(body.heading)

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        sideways = Mode.VELOCITY if self.frame == Frame.WORLD else Mode.HEADING_VELOCITY
        up = Mode.VELOCITY if self.z is None else Mode.POSITION
        modes: Modes = (sideways, sideways, self.yaw_control.mode, up)
        travel = torch.tensor([*self.velocity, 0.0], dtype=torch.float64).repeat(len(body), 1)
        heading = self.yaw_control.goal(travel, ACCURACY)
        height = self.climb if self.z is None else self.z
        return goals_of(body, modes, *self.velocity, heading, height)


@dataclasses.dataclass(frozen=True)
class Sticks:
    """Positions of a remote control's sticks, each from -1 to 1.

    Raises:
        InputError: A position is out of range.
    """

    pitch: float = 0.0
    """Forward."""
    roll: float = 0.0
    """To the right."""
    throttle: float = 0.0
    """Up."""
    yaw: float = 0.0
    """To the right."""

    def __post_init__(self) -> None:
        """Check the positions."""
        for field in dataclasses.fields(self):
            number = real(getattr(self, field.name), field.name, -1.0, 1.0)
            object.__setattr__(self, field.name, number)


class StickCommand(Command):
    """Reads the sticks in each period. Directions are relative to the heading at the start."""

    succeeds_at_limit = True

    def __init__(
        self,
        read: Callable[[], Sticks],
        duration: float,
        *,
        vx_max: float,
        vy_max: float,
        z_max: float,
        yaw_control: YawControl | None = None,
    ) -> None:
        """Create the command.

        Args:
            read: Returns the current stick positions.
            duration: Seconds.
            vx_max: Forward speed at full stick, metres per second.
            vy_max: Sideways speed at full stick.
            z_max: Height of the goal above the drone at full throttle, metres.
            yaw_control: Heading control.
        """
        self.limit, self.read = duration, read
        self.vx_max, self.vy_max, self.z_max = vx_max, vy_max, z_max
        self.yaw_control = yaw_control or YawControl()

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.first = body.heading.clone()
        self.yaw_control.begin(self.first)

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        sticks = self.read()
        forward, left = sticks.pitch * self.vx_max, -sticks.roll * self.vy_max
        cos, sin = self.first.cos(), self.first.sin()
        x, y = cos * forward - sin * left, sin * forward + cos * left
        travel = torch.stack([x, y, torch.zeros_like(x)], -1)
        heading = self.yaw_control.goal(travel, ACCURACY)
        heading = heading - math.radians(YAW_AT_FULL_STICK) * sticks.yaw
        modes: Modes = (Mode.VELOCITY, Mode.VELOCITY, self.yaw_control.mode, Mode.POSITION)
        z = (body.position[:, 2] + sticks.throttle * self.z_max).clamp(min=0.0)
        return goals_of(body, modes, x, y, heading, z)
