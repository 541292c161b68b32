"""The trial flight of a firmware: arm, take off, hover, fly a square, land; and how well it did."""

import dataclasses
import itertools
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from drone_rl.config import DynamicsSettings
from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.flight import LoopedDrone, Moment, Pilot
from drone_rl.flight.firmware.senses import Senses, Vector
from drone_rl.flight.firmware.sticks import Wish, velocity_to
from drone_rl.sim.dynamics import BodyState

LANDING_SPEED = 0.5
"""Metres a second, downwards."""
_NEAR_GROUND = 0.1
"""Height above where it stood, in metres, at which the rotors are stopped."""
_SETTLING = 3.0
"""Seconds of hovering before the drone's place counts."""


@dataclasses.dataclass(frozen=True)
class Course:
    """What is flown."""

    height: float = 3.0
    """Metres above where it stood."""
    side: float = 10.0
    """Of the square, metres."""
    speed: float = 2.0
    """Along the square, metres a second."""
    hover: float = 6.0
    """Seconds over the place of take-off, the first three of which don't count."""


@dataclasses.dataclass(frozen=True)
class CourseReport:
    """How a trial flight went."""

    hover_error_m: float
    """Mean distance from the place where it was to hover."""
    path_error_m: float
    """Mean distance from the square."""
    path_error_max_m: float
    """The greatest."""
    landing_error_m: float
    """Horizontal distance of the landing from the take-off."""
    simulated_s: float
    """Length of the flight, arming included."""
    wall_s: float
    """The same on the clock on the wall."""

    def values(self) -> dict[str, Any]:
        """As plain data."""
        return dataclasses.asdict(self)


class HoldPilot:
    """Stays in a place, and looks one way."""

    def __init__(self, place: Vector, settings: DynamicsSettings, heading: float = 0.0) -> None:
        """Takes the place, in metres, world frame; shape (3,)."""
        self.place = place
        self.settings = settings
        self.heading = heading

    def __call__(self, body: BodyState, senses: Senses) -> Wish:
        """See `Pilot`."""
        del body
        return Wish(velocity_to(self.place, senses, self.settings), self.heading)


class PathPilot:
    """Follows a point that moves along a path at a steady speed."""

    def __init__(self, path: Sequence[Vector], speed: float, settings: DynamicsSettings) -> None:
        """Takes corners, in metres, world frame; each of shape (3,)."""
        self.path = np.array(path)
        self.speed = speed
        self.settings = settings
        steps = np.linalg.norm(np.diff(self.path, axis=0), axis=1)
        self._until = np.concatenate([[0.0], np.cumsum(steps)])
        self._begin: float | None = None

    @property
    def seconds(self) -> float:
        """That it takes."""
        return float(self._until[-1]) / self.speed

    def __call__(self, body: BodyState, senses: Senses) -> Wish:
        """See `Pilot`; the path begins when it is first asked."""
        del body
        if self._begin is None:
            self._begin = senses.time
        place, ahead = self._point(senses.time - self._begin)
        back = np.array(velocity_to(place, senses, self.settings))
        x, y, z = (float(v) for v in back + ahead)
        return Wish((x, y, z))

    def _point(self, seconds: float) -> tuple[Vector, Vector]:
        """Where the point is, and its velocity. Shapes: (3,)."""
        along = seconds * self.speed
        leg = int(np.searchsorted(self._until, along, side="right")) - 1
        if leg >= len(self.path) - 1:
            return self.path[-1], np.zeros(3)
        way = self.path[leg + 1] - self.path[leg]
        direction = way / np.linalg.norm(way)
        return self.path[leg] + direction * (along - self._until[leg]), direction * self.speed


def fly_course(drone: LoopedDrone[Any], course: Course | None = None) -> CourseReport:
    """Arms, takes off, hovers, flies a square and lands.

    Args:
        drone: Standing on the ground.
        course: What to fly.

    Raises:
        LoopError: It doesn't arm, reach its height or land; or the firmware is gone.
    """
    course = course or Course()
    begin, settings, ground = time.monotonic(), drone.settings, drone.senses.position
    drone.arm()
    above = ground + np.array([0.0, 0.0, course.height])
    take_off(drone, above)
    hover = _fly(drone, HoldPilot(above, settings), course.hover)
    path = square(above, course.side)
    follow = PathPilot(path, course.speed, settings)
    square_flown = _fly(drone, follow, follow.seconds)
    _fly(drone, HoldPilot(above, settings), _SETTLING)
    land(drone, ground)
    counted = [m for m in hover if m.time >= hover[0].time + _SETTLING] or hover
    errors = np.array([distance_from(path, m.position) for m in square_flown])
    return CourseReport(
        hover_error_m=float(np.mean([np.linalg.norm(m.position - above) for m in counted])),
        path_error_m=float(errors.mean()),
        path_error_max_m=float(errors.max()),
        landing_error_m=float(np.linalg.norm((drone.senses.position - ground)[:2])),
        simulated_s=drone.time,
        wall_s=time.monotonic() - begin,
    )


def take_off(drone: LoopedDrone[Any], above: Vector, within: float = 10.0) -> None:
    """Climbs to a place above an armed drone.

    Raises:
        LoopError: It isn't there in time.
    """
    pilot = HoldPilot(above, drone.settings)
    if not drone.fly(pilot, within, until=lambda s: abs(s.position[2] - above[2]) < 0.3):
        height = float(drone.senses.position[2])
        raise LoopError(f"take-off: at {height:.2f} m, not {above[2]:.2f} m, after {within:g} s")


def land(drone: LoopedDrone[Any], ground: Vector, within: float = 20.0) -> None:
    """Comes down over a place, stops the rotors and disarms.

    Args:
        drone: In flight.
        ground: Where it is to stand. Shape: (3,).
        within: Seconds.

    Raises:
        LoopError: It isn't on the ground in time.
    """
    hold = HoldPilot(ground, drone.settings)

    def down(body: BodyState, senses: Senses) -> Wish:
        forward, left, _ = hold(body, senses).velocity
        return Wish((forward, left, -LANDING_SPEED))

    low = ground[2] + _NEAR_GROUND
    if not drone.fly(down, within, until=lambda s: bool(s.position[2] < low)):
        raise LoopError(f"landing: still {drone.senses.position[2]:.2f} m up after {within:g} s")
    drone.disarm()


def square(corner: Vector, side: float) -> list[Vector]:
    """A square's corners from one back to it: forward, to the left, back, to the right."""
    steps = ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0))
    return [corner + np.array([x, y, 0.0]) for x, y in steps]


def distance_from(path: Sequence[Vector], place: Vector) -> float:
    """Of a place from the nearest point of a path, metres."""
    least = math.inf
    for start, end in itertools.pairwise(path):
        way = end - start
        along = float(np.clip((place - start) @ way / (way @ way), 0.0, 1.0))
        least = min(least, float(np.linalg.norm(place - start - along * way)))
    return least


def _fly(drone: LoopedDrone[Any], pilot: Pilot[Any], seconds: float) -> list[Moment]:
    """What is remembered of so much of the flight."""
    first = len(drone.trace)
    drone.fly(pilot, seconds)
    return drone.trace[first:]
