"""Path following by pure pursuit to a lookahead point on a polyline; heading control on the way.

All functions are batched over `num_envs` paths of P points each (the last point may be repeated).
Positions are in metres in the world frame; `along` is an arc length in metres.
"""

import dataclasses
import enum
import math

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.flight.commands.checks import degrees
from drone_rl.flight.commands.command import ACCURACY, PERIOD, Command, Land
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
        number = degrees(self.yaw_or_rate, "yaw_or_rate")
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
        drivetrain = OneOf(tuple(Drivetrain)).read(drivetrain, "drivetrain")
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
        self._heading = body.heading.clone()

    def goal(self, travel: Tensor) -> Tensor:
        """Return the heading goals, radians (per second). Shape: (num_envs,).

        `travel` is a displacement or velocity in the world frame, shape (num_envs, 3); up to a
        horizontal length of `ACCURACY` the previous goal is kept.
        """
        *_, wanted = to_simulator(0.0, 0.0, math.radians(self.yaw_mode.yaw_or_rate))
        if not self.is_forward:
            holds = self.yaw_mode.is_rate and self.mode is Mode.ANGLE
            return self._heading if holds else torch.full_like(travel[:, 0], wanted)
        x, y, _ = travel.unbind(-1)
        along = torch.atan2(y, x) + wanted
        self._heading = torch.where(torch.hypot(x, y) > ACCURACY, along, self._heading)
        return self._heading


class PathCommand(Command):
    """Follows a path at a given speed, brakes for its last point and holds it."""

    def __init__(
        self,
        body: FlightState,
        points: Tensor,
        speed: float | Tensor,
        limit: float,
        *,
        yaw_control: YawControl | None = None,
        lookahead: float = AUTOMATIC,
        adaptive: float = 1.0,
        braking: float = 1.8,
    ) -> None:
        """Take the state at the start and the waypoints, metres. Shape: (num_envs, P, 3).

        The speed is in metres per second, for all drones or for each, shape (num_envs,); the
        command fails after `limit` seconds. See `lookahead_of` for `lookahead` and `adaptive`, and
        `braking_time`. A lookahead that is too short is an `InputError`.
        """
        self.limit, self.adaptive = limit, adaptive
        self.paths = make_paths(torch.cat([body.position[:, None], points], 1))
        """The paths, from the position at the start through all waypoints."""
        self.speed = torch.as_tensor(speed, dtype=torch.float64).expand(len(points))
        ahead = [lookahead_of(pace, lookahead, adaptive) for pace in self.speed.tolist()]
        self.lookahead = self._ahead = self.speed.new_tensor(ahead)
        self.yaw_control = yaw_control or YawControl(body)
        self.along = torch.zeros(len(body), dtype=torch.float64)
        last = direction_at(self.paths, (self.paths.lengths - 1e-6).clamp(min=0.0))
        level = last[:, :2].norm(dim=-1)
        self.braking = level * braking + (1.0 - level) * _VERTICAL_BRAKING

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        position, paths = body.position, self.paths
        self.along = nearest(paths, position, self.along, self.along + self._ahead)
        place = place_at(paths, self.along)
        self._ahead = self.lookahead + self.adaptive * (position - place).norm(dim=-1)
        ahead = place_at(paths, self.along + self._ahead) - position
        pace = torch.maximum(self._pace(self._left(body)), self.speed.clamp(max=_SLOWEST))
        sideways = ahead[:, :2] * (pace / ahead.norm(dim=-1).clamp(min=1e-9))[:, None]
        heading = self.yaw_control.goal(ahead)
        values = torch.cat([sideways, heading[:, None], place[:, 2:]], 1)
        drift = torch.zeros_like(values)
        climb = self._pace(paths.lengths - self.along)
        drift[:, 3] = climb * direction_at(paths, self.along)[:, 2]
        modes = (Mode.VELOCITY, Mode.VELOCITY, self.yaw_control.mode, Mode.POSITION)
        return FlightGoals(modes, values, drift)

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones are near the last point, with the end of the path in lookahead."""
        is_last = self.along + self._ahead >= self.paths.lengths
        return is_last & ((self.paths.ends - body.position).norm(dim=-1) <= ACCURACY)

    def rest(self, body: FlightState) -> Tensor:
        """Return the last points, with the commanded heading if there is one."""
        heading = body.heading
        if self.yaw_control.mode == Mode.ANGLE:
            heading = self.yaw_control.goal(torch.zeros_like(self.paths.ends))
        x, y, z = self.paths.ends.unbind(-1)
        return torch.stack([x, y, heading, z], -1)

    def _pace(self, left: Tensor) -> Tensor:
        """Return the speed, m/s, at a distance from the end."""
        return torch.minimum(left / self.braking, self.speed)

    def _left(self, body: FlightState) -> Tensor:
        """Return the distance to the end along the path, near it at least the straight distance."""
        beyond = (self.paths.ends - body.position).norm(dim=-1)
        left = self.paths.lengths - self.along
        return torch.where(left > self._ahead, left, torch.maximum(left, beyond))


class TakeoffCommand(PathCommand):
    """Climbs straight up."""

    def __init__(self, body: FlightState, limit: float) -> None:
        """Take the state at the start and the time limit in seconds."""
        up = body.position.new_tensor([0.0, 0.0, TAKEOFF_HEIGHT])
        super().__init__(body, (body.position + up)[:, None], TAKEOFF_SPEED, limit)

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones have reached the height."""
        return body.position[:, 2] >= self.paths.ends[:, 2] - _TAKEOFF_MARGIN


class GoHomeCommand(Command):
    """Follows a path and lands once every drone has reached its end."""

    def __init__(self, path: PathCommand, landing_limit: float) -> None:
        """Take the path, and the seconds that may be added to its time limit for the landing."""
        self.limit = path.limit + landing_limit
        self._path = path
        self._landing: Land | None = None

    def goals(self, body: FlightState) -> FlightGoals:
        """See `Command`."""
        return (self._landing or self._path).goals(body)

    def is_complete(self, body: FlightState) -> Tensor:
        """Return which drones have landed; switch to landing at the end of the path."""
        if self._landing is not None:
            return self._landing.is_complete(body)
        there = self._path.is_complete(body)
        if bool(there.all()):
            self._landing = Land(body, self.limit)
            self._landing.reference[:] = self._path.rest(body)
        return torch.zeros_like(there)


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


@dataclasses.dataclass(frozen=True)
class Paths:
    """A batch of polylines."""

    points: Tensor  # (num_envs, P, 3) float64
    """Waypoints in order."""
    along: Tensor  # (num_envs, P) float64
    """Arc length at each waypoint."""
    directions: Tensor  # (num_envs, P - 1, 3) float64
    """Unit vectors from each waypoint to the next; zeros between equal waypoints."""

    @property
    def ends(self) -> Tensor:
        """The last points. Shape: (num_envs, 3)."""
        return self.points[:, -1]

    @property
    def lengths(self) -> Tensor:
        """Lengths of the paths. Shape: (num_envs,)."""
        return self.along[:, -1]


def make_paths(points: Tensor) -> Paths:
    """Build paths through points. Shape: (num_envs, P, 3), P at least 2."""
    steps = points.diff(dim=1)
    lengths = steps.norm(dim=-1)
    along = torch.nn.functional.pad(lengths.cumsum(-1), (1, 0))
    return Paths(points, along, steps / lengths.clamp(min=1e-12)[..., None])


def place_at(paths: Paths, along: Tensor) -> Tensor:
    """Return the points at arc lengths, clamped to the ends. Shape: (num_envs, 3)."""
    row, line = _segments_at(paths, along)
    rest = (torch.minimum(along, paths.lengths) - paths.along[row, line])[:, None]
    return paths.points[row, line] + rest * paths.directions[row, line]


def direction_at(paths: Paths, along: Tensor) -> Tensor:
    """Return the unit tangents at arc lengths. Shape: (num_envs, 3)."""
    return paths.directions[_segments_at(paths, along)]


def nearest(paths: Paths, position: Tensor, first: Tensor, last: Tensor) -> Tensor:
    """Return the arc lengths of the nearest points between `first` and `last`.

    Shapes: (num_envs, 3) of the position, else (num_envs,).
    """
    low = torch.maximum(paths.along[:, :-1], first[:, None])
    high = torch.minimum(paths.along[:, 1:], last[:, None])
    away = position[:, None] - paths.points[:, :-1]
    reach = (away * paths.directions).sum(-1) + paths.along[:, :-1]
    lengths = torch.minimum(torch.maximum(reach, low), high)
    rest = (lengths - paths.along[:, :-1])[..., None] * paths.directions
    distance = (away - rest).norm(dim=-1).masked_fill(low > high, torch.inf)
    return lengths.gather(1, distance.argmin(1, keepdim=True))[:, 0]


def distance_from(paths: Paths, position: Tensor) -> Tensor:
    """Return the distances of positions from whole paths. Shape: (num_envs,)."""
    along = nearest(paths, position, torch.zeros_like(paths.lengths), paths.lengths)
    return (position - place_at(paths, along)).norm(dim=-1)


def _segments_at(paths: Paths, along: Tensor) -> tuple[Tensor, Tensor]:
    """Return row and index of the segment at each arc length; the later one at a waypoint."""
    line = (paths.along[:, 1:-1] <= along[:, None]).sum(-1)
    return torch.arange(len(line), device=line.device), line
