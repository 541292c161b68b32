"""Along a path, after a carrot that runs ahead on it."""

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.flight.commands.command import ACCURACY, PERIOD, Command
from drone_rl.flight.commands.paths import Paths, direction_at, make_paths, nearest, place_at
from drone_rl.flight.commands.turning import Turning
from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.utils.errors import InputError

AUTOMATIC = -1.0
"""The lookahead that is worked out of the speed."""
_PERIODS_AHEAD = 30.0
_PERIODS_AHEAD_FIXED = 40.0
"""Where the lookahead doesn't adapt."""
_SLOWEST = 0.6
"""Metres a second below which no drone brakes before its end, lest wind keep it from there."""
_VERTICAL_BRAKING = 0.5
"""Seconds; climbs are controlled more tightly than what goes sideways."""


def lookahead_of(speed: float, lookahead: float = AUTOMATIC, adaptive: float = 1.0) -> float:
    """How far ahead on its path a drone looks.

    Args:
        speed: Metres a second.
        lookahead: What was asked for, metres; automatic below 0.
        adaptive: How much of the distance from the path comes on top.

    Raises:
        InputError: With so little no drone gets ahead.
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
    """Seconds of way, at the speed that remains, over which a drone brakes without overshoot.

    That is twice the time constant of the loop that controls its horizontal speed.
    """
    pull = GRAVITY * settings.velocity_gain * settings.angle_limit
    return min(2.0 / max(pull, 1e-3), 20.0)


class AlongPath(Command):
    """Flies through points at a speed, and brakes for the last one, where drones stay."""

    def __init__(
        self,
        points: Tensor,
        speed: float | Tensor,
        limit: float,
        *,
        turning: Turning | None = None,
        lookahead: float = AUTOMATIC,
        adaptive: float = 1.0,
        accuracy: float = ACCURACY,
        braking: float = 1.8,
    ) -> None:
        """Takes the path.

        Args:
            points: From where drones are, on through these. Metres. Shape: (num_worlds, P, 3).
            speed: Metres a second, for all or for each. Shape: (num_worlds,).
            limit: Seconds after which it has failed.
            turning: Where drones look meanwhile.
            lookahead: See `lookahead_of`.
            adaptive: How much of its distance from the path a drone looks farther ahead.
            accuracy: Distance from the last point, metres, at which the command is done.
            braking: See `braking_time`.

        Raises:
            InputError: See `lookahead_of`.
        """
        self.limit = limit
        self.points, self.accuracy, self.adaptive = points, accuracy, adaptive
        self.speed = torch.as_tensor(speed, dtype=torch.float64).expand(len(points))
        ahead = [lookahead_of(pace, lookahead, adaptive) for pace in self.speed.tolist()]
        self.lookahead = self.speed.new_tensor(ahead)
        self.turning = turning or Turning()
        self._braking = braking
        self._paths: Paths | None = None

    @property
    def paths(self) -> Paths:
        """From where drones were told, through all points."""
        assert self._paths is not None, "the command hasn't begun"
        return self._paths

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self._paths = make_paths(torch.cat([body.position[:, None], self.points], 1))
        self.turning.begin(body.heading)
        self.along = torch.zeros(len(body), dtype=torch.float64)
        self._ahead = self.lookahead
        last = direction_at(self.paths, (self.paths.lengths - 1e-6).clamp(min=0.0))
        level = last[:, :2].norm(dim=-1)
        self.braking = level * self._braking + (1.0 - level) * _VERTICAL_BRAKING

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        position, paths = body.position, self.paths
        self.along = nearest(paths, position, self.along, self.along + self._ahead)
        place = place_at(paths, self.along)
        self._ahead = self.lookahead + self.adaptive * (position - place).norm(dim=-1)
        ahead = place_at(paths, self.along + self._ahead) - position
        pace = torch.maximum(self._pace(self._left(body)), self.speed.clamp(max=_SLOWEST))
        sideways = ahead[:, :2] * (pace / ahead.norm(dim=-1).clamp(min=1e-9))[:, None]
        heading = self.turning.goal(ahead, ACCURACY)
        values = torch.cat([sideways, heading[:, None], place[:, 2:]], 1)
        drift = torch.zeros_like(values)
        climb = self._pace(paths.lengths - self.along)
        drift[:, 3] = climb * direction_at(paths, self.along)[:, 2]
        return Goals(
            (Mode.VELOCITY, Mode.VELOCITY, self.turning.mode, Mode.POSITION), values, drift
        )

    def is_complete(self, body: FlightState) -> Tensor:
        """Near the last point, with no other one left before it."""
        is_last = self.along + self._ahead >= self.paths.lengths
        return is_last & ((self.paths.ends - body.position).norm(dim=-1) <= self.accuracy)

    def rest(self, body: FlightState) -> Tensor:
        """At the last points; those who are turned by an angle stay so."""
        heading = body.heading
        if self.turning.mode == Mode.ANGLE:
            heading = self.turning.goal(torch.zeros_like(self.paths.ends), ACCURACY)
        x, y, z = self.paths.ends.unbind(-1)
        return torch.stack([x, y, heading, z], -1)

    def _pace(self, left: Tensor) -> Tensor:
        """Metres a second, so many metres before the end."""
        return torch.minimum(left / self.braking, self.speed)

    def _left(self, body: FlightState) -> Tensor:
        """Metres to the end, along the path or, once that is behind, back to it."""
        beyond = (self.paths.ends - body.position).norm(dim=-1)
        left = self.paths.lengths - self.along
        return torch.where(left > self._ahead, left, torch.maximum(left, beyond))
