"""Flying by hand: sticks that are moved while time passes."""

import dataclasses
import math
from collections.abc import Callable

import torch

from drone_rl.flight.commands.checks import real
from drone_rl.flight.commands.command import ACCURACY, Command, goals_of
from drone_rl.flight.commands.turning import Turning
from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.sim.dynamics.control import Modes

YAW_AT_FULL_STICK = 100.0
"""Degrees (a second) that the stick adds to the yaw mode's."""


@dataclasses.dataclass(frozen=True)
class Sticks:
    """Where the sticks stand, each from -1 to 1; in the middle by default.

    Raises:
        InputError: One stands nowhere.
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
        """Refuses what no stick can do."""
        for field in dataclasses.fields(self):
            number = real(getattr(self, field.name), field.name, -1.0, 1.0)
            object.__setattr__(self, field.name, number)


class BySticks(Command):
    """Reads the sticks every period. Directions are those in which drones looked when it began."""

    lasts = True

    def __init__(
        self,
        read: Callable[[], Sticks],
        duration: float,
        *,
        vx_max: float,
        vy_max: float,
        z_max: float,
        turning: Turning | None = None,
    ) -> None:
        """Takes sticks and what they do.

        Args:
            read: Tells where they stand.
            duration: Seconds.
            vx_max: Metres a second forward when the stick is as far forward as it goes.
            vy_max: The same to the sides.
            z_max: How far above the drone its goal is when the throttle is as high as it goes,
                metres: so fast it climbs.
            turning: Where drones look meanwhile.
        """
        self.limit, self.read = duration, read
        self.vx_max, self.vy_max, self.z_max = vx_max, vy_max, z_max
        self.turning = turning or Turning()

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.first = body.heading.clone()
        self.turning.begin(self.first)

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        sticks = self.read()
        forward, left = sticks.pitch * self.vx_max, -sticks.roll * self.vy_max
        cos, sin = self.first.cos(), self.first.sin()
        x, y = cos * forward - sin * left, sin * forward + cos * left
        travel = torch.stack([x, y, torch.zeros_like(x)], -1)
        heading = self.turning.goal(travel, ACCURACY)
        heading = heading - math.radians(YAW_AT_FULL_STICK) * sticks.yaw
        modes: Modes = (Mode.VELOCITY, Mode.VELOCITY, self.turning.mode, Mode.POSITION)
        z = (body.position[:, 2] + sticks.throttle * self.z_max).clamp(min=0.0)
        return goals_of(body, modes, x, y, heading, z)
