"""Path following by pure pursuit to a lookahead point on a polyline; heading control on the way.

Positions are in metres in the world frame, shape (3,); `along` is an arc length in metres.
"""

import dataclasses
import enum
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.flight.commands.checks import DEGREES, time_limit
from drone_rl.flight.commands.command import ACCURACY, PERIOD, Command, Land, goals_of
from drone_rl.sim.coordinates import to_simulator
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Flag, OneOf

TAKEOFF_HEIGHT = 2.0
"""Climb of a take-off, metres."""
TAKEOFF_SPEED = 0.5
"""Metres per second."""
AUTOMATIC = -1.0
"""A lookahead that is computed from the speed."""
_TAKEOFF_MARGIN = 0.1
"""A take-off is complete this far below its height, metres. Wind may shift it sideways."""
_PERIODS_AHEAD = 30.0
"""Lookahead in control periods if it grows with the distance from the path."""
_PERIODS_AHEAD_FIXED = 40.0
"""Lookahead in control periods if it does not."""
_SLOWEST = 0.6
"""Braking keeps this speed, m/s, so that wind cannot stop a drone short of the end."""
_VERTICAL_BRAKING = 0.5
"""Braking time of a climb, seconds; climbs are controlled more tightly than horizontal motion."""


class Drivetrain(enum.StrEnum):
    """Whether a drone turns into its direction of travel (Table 3)."""

    FORWARD_ONLY = "forward_only"
    """The drone faces its direction of travel."""
    MAX_DEGREE_OF_FREEDOM = "max_degree_of_freedom"
    """The heading follows the yaw mode, whatever the direction of travel."""


@dataclasses.dataclass(frozen=True)
class YawMode:
    """Heading or yaw rate during a movement (Table 3). Positive is to the right."""

    is_rate: bool = True
    """Whether the number is a rate, else an angle. A rate of 0 holds the heading."""
    yaw_or_rate: float = 0.0
    """Degrees per second; or degrees, from the world's x axis, or from the direction of travel with
    `Drivetrain.FORWARD_ONLY`."""

    def __post_init__(self) -> None:
        """Check both values."""
        Flag().read(self.is_rate, "is_rate")
        number = DEGREES.read(self.yaw_or_rate, "yaw_or_rate")
        object.__setattr__(self, "yaw_or_rate", number)


class YawControl:
    """Computes the third of the four `FlightGoals.values`, the heading, in each control period."""

    def __init__(
        self,
        body: FlightState,
        drivetrain: str = Drivetrain.MAX_DEGREE_OF_FREEDOM,
        yaw_mode: YawMode | None = None,
    ) -> None:
        """Take the state at the start, a `Drivetrain` and a `YawMode`.

        By default the drone holds its heading or, with `Drivetrain.FORWARD_ONLY`, faces its
        direction of travel; the latter can't be combined with a rate.
        """
        drivetrain = OneOf(tuple(kind.value for kind in Drivetrain)).read(drivetrain, "drivetrain")
        self.is_forward = drivetrain == Drivetrain.FORWARD_ONLY
        self.yaw_mode = yaw_mode or YawMode()
        if not isinstance(self.yaw_mode, YawMode):
            raise InputError(
                f"yaw_mode={yaw_mode!r} is not a YawMode; give YawMode(is_rate, yaw_or_rate)"
            )
        is_rate = self.yaw_mode.is_rate and self.yaw_mode.yaw_or_rate != 0.0
        if self.is_forward and is_rate:
            raise InputError(
                f"yaw_mode={self.yaw_mode} turns at a rate, but drivetrain=forward_only faces the "
                "direction of travel; give is_rate=False, or max_degree_of_freedom"
            )
        self.mode = Mode.RATE if is_rate else Mode.ANGLE
        """Goal mode of the heading."""
        self._heading = float(body.heading[0])

    def goal(self, x: float, y: float) -> float:
        """Return the heading goal, radians (per second).

        x and y are of a displacement or velocity in the world frame; up to a length of `ACCURACY`
        the previous goal is kept.
        """
        *_, wanted = to_simulator(0.0, 0.0, math.radians(self.yaw_mode.yaw_or_rate))
        if not self.is_forward:
            holds = self.yaw_mode.is_rate and self.mode is Mode.ANGLE
            return self._heading if holds else wanted
        if math.hypot(x, y) > ACCURACY:
            self._heading = math.atan2(y, x) + wanted
        return self._heading


class Path:
    """A polyline."""

    def __init__(self, points: ArrayLike) -> None:
        """Take the waypoints, at least two; some may be equal. Shape: (P, 3)."""
        self.points: NDArray[np.float64] = np.array(points, dtype=np.float64)
        steps = np.diff(self.points, axis=0)
        lengths = np.linalg.norm(steps, axis=-1)
        self.along = np.concatenate([[0.0], np.cumsum(lengths)])
        """Arc length at each waypoint. Shape: (P,)."""
        self.directions = steps / np.maximum(lengths, 1e-12)[:, None]
        """Unit vectors from each waypoint to the next; zeros between equal ones. (P - 1, 3)."""
        self.length = float(self.along[-1])

    def place_at(self, along: float) -> NDArray[np.float64]:
        """Return the point at an arc length, clamped to the ends."""
        line = self._line_at(along)
        rest = min(along, self.length) - self.along[line]
        return self.points[line] + rest * self.directions[line]

    def direction_at(self, along: float) -> NDArray[np.float64]:
        """Return the unit tangent at an arc length, of the later segment at a waypoint."""
        return self.directions[self._line_at(along)]

    def nearest(self, position: ArrayLike, first: float = 0.0, last: float = math.inf) -> float:
        """Return the arc length of the nearest point between two arc lengths."""
        starts = self.along[:-1]
        low, high = np.maximum(starts, first), np.minimum(self.along[1:], last)
        away = np.asarray(position) - self.points[:-1]
        along = np.clip((away * self.directions).sum(-1) + starts, low, np.maximum(low, high))
        missing = away - (along - starts)[:, None] * self.directions
        distance = np.where(low > high, np.inf, np.linalg.norm(missing, axis=-1))
        return float(along[distance.argmin()])

    def distance_from(self, position: ArrayLike) -> float:
        """Return the distance of a position."""
        return float(np.linalg.norm(np.asarray(position) - self.place_at(self.nearest(position))))

    def _line_at(self, along: float) -> int:
        return int((self.along[1:-1] <= along).sum())


class PathCommand(Command):
    """Follows a path at a given speed, brakes for its last point and holds it."""

    def __init__(
        self,
        body: FlightState,
        points: ArrayLike,
        speed: float,
        timeout: float | None = None,
        *,
        yaw_control: YawControl | None = None,
        lookahead: float = AUTOMATIC,
        adaptive: float = 1.0,
        braking: float = 1.8,
    ) -> None:
        """Take the state at the start and the waypoints, metres. Shape: (P, 3).

        The speed is in metres per second; for `timeout` see `time_limit`, for `lookahead` and
        `adaptive` `lookahead_of`, and `braking_time`. A lookahead that is too short is an
        `InputError`.
        """
        self.path = Path([body.position[0].tolist(), *np.asarray(points)])
        """From the position at the start through all waypoints."""
        self.limit = time_limit(timeout, self.path.length, speed)
        self.speed, self.adaptive = speed, adaptive
        self.lookahead = self._ahead = lookahead_of(speed, lookahead, adaptive)
        self.yaw_control = yaw_control or YawControl(body)
        self.along = 0.0
        last = self.path.direction_at(max(self.path.length - 1e-6, 0.0))
        level = math.hypot(*last[:2])
        self.braking = level * braking + (1.0 - level) * _VERTICAL_BRAKING

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        position, path = body.position[0].numpy(), self.path
        self.along = path.nearest(position, self.along, self.along + self._ahead)
        place = path.place_at(self.along)
        self._ahead = self.lookahead + self.adaptive * math.dist(position, place)
        ahead = path.place_at(self.along + self._ahead) - position
        pace = max(self._pace(self._left(position)), min(self.speed, _SLOWEST))
        x, y, _ = ahead * (pace / max(math.hypot(*ahead), 1e-9))
        climb = self._pace(path.length - self.along) * float(path.direction_at(self.along)[2])
        modes = (Mode.VELOCITY, Mode.VELOCITY, self.yaw_control.mode, Mode.POSITION)
        return goals_of(modes, x, y, self.yaw_control.goal(*ahead[:2]), place[2], climb=climb)

    def is_complete(self, body: FlightState) -> bool:
        """Return whether the last point is near, and the end of the path in lookahead."""
        is_last = self.along + self._ahead >= self.path.length
        return is_last and math.dist(self.path.points[-1], body.position[0].numpy()) <= ACCURACY

    def rest(self, body: FlightState) -> list[float]:
        """Return the last point, with the commanded heading if there is one."""
        is_angle = self.yaw_control.mode is Mode.ANGLE
        heading = self.yaw_control.goal(0.0, 0.0) if is_angle else float(body.heading[0])
        x, y, z = self.path.points[-1].tolist()
        return [x, y, heading, z]

    def _pace(self, left: float) -> float:
        """Return the speed, m/s, at a distance from the end."""
        return min(left / self.braking, self.speed)

    def _left(self, position: NDArray[np.float64]) -> float:
        """Return the distance to the end along the path, near it at least the straight distance."""
        left = self.path.length - self.along
        beyond = math.dist(self.path.points[-1], position)
        return left if left > self._ahead else max(left, beyond)


class TakeoffCommand(PathCommand):
    """Climbs straight up."""

    def __init__(self, body: FlightState, timeout: float | None = None) -> None:
        """Take the state at the start; see `PathCommand`."""
        x, y, z = body.position[0].tolist()
        super().__init__(body, [(x, y, z + TAKEOFF_HEIGHT)], TAKEOFF_SPEED, timeout)

    def is_complete(self, body: FlightState) -> bool:
        """Return whether the drone has reached the height."""
        return float(body.position[0, 2]) >= self.path.points[-1, 2] - _TAKEOFF_MARGIN


class GoHomeCommand(Command):
    """Follows a path and lands at its end."""

    def __init__(self, path: PathCommand, landing_limit: float) -> None:
        """Take the path, and the seconds that may be added to its time limit for the landing."""
        self.limit = path.limit + landing_limit
        self._path = path
        self._landing: Land | None = None

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        return (self._landing or self._path).goals(body)

    def is_complete(self, body: FlightState) -> bool:
        """Return whether the drone has landed; switch to landing at the end of the path."""
        if self._landing is not None:
            return self._landing.is_complete(body)
        if self._path.is_complete(body):
            self._landing = Land(body, self.limit, self._path.rest(body))
        return False


def lookahead_of(speed: float, lookahead: float = AUTOMATIC, adaptive: float = 1.0) -> float:
    """Return the lookahead distance, metres, at a speed in metres per second.

    A `lookahead` below 0 is computed from the speed; `adaptive` is added per metre of distance from
    the path. One that is too short to make progress is an `InputError`.
    """
    if lookahead < 0.0:
        periods = _PERIODS_AHEAD if adaptive > 0.0 else _PERIODS_AHEAD_FIXED
        return max(1.5 * ACCURACY, periods * PERIOD * speed)
    least = max(ACCURACY, PERIOD * speed)
    if lookahead < least:
        raise InputError(
            f"lookahead={lookahead:g} is too short at {speed:g} m/s; give at least {least:g}, or "
            f"{AUTOMATIC:g} for automatic"
        )
    return lookahead


def braking_time(settings: DynamicsSettings) -> float:
    """Return the braking time without overshoot, seconds (remaining distance over speed).

    It is twice the time constant of the horizontal velocity loop, but at most 20 s.
    """
    pull = GRAVITY * settings.velocity_gain * settings.angle_limit
    return min(2.0 / max(pull, 1e-3), 20.0)
