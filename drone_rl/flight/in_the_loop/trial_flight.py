"""A trial flight of a flight controller: hover, fly a square, land; and its errors."""

import dataclasses
import itertools
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from drone_rl.config import DynamicsSettings
from drone_rl.flight.in_the_loop.control import Setpoint, velocity_to
from drone_rl.flight.in_the_loop.drone import (
    DroneInTheLoop,
    FlightControllerError,
    Guidance,
    TraceSample,
)
from drone_rl.flight.in_the_loop.instruments import Readings, Vector
from drone_rl.sim.dynamics import BodyState

LANDING_SPEED = 0.5
"""Sink rate, metres per second."""
_NEAR_GROUND = 0.1
"""Height above the ground at which the rotors are stopped, metres."""
_SETTLING = 3.0
"""Seconds of hovering that are not measured."""


@dataclasses.dataclass(frozen=True)
class Course:
    """Settings of a trial flight."""

    height: float = 3.0
    """Height above the ground, metres."""
    side: float = 10.0
    """Side of the square, metres."""
    speed: float = 2.0
    """Speed along the square, metres per second."""
    hover: float = 6.0
    """Seconds of hovering; the first three are not measured."""


@dataclasses.dataclass(frozen=True)
class CourseReport:
    """Results of a trial flight."""

    hover_error_m: float
    """Mean distance from the hover position."""
    path_error_m: float
    """Mean distance from the square."""
    path_error_max_m: float
    """Greatest distance from the square."""
    landing_error_m: float
    """Horizontal distance of the landing from the take-off."""
    simulated_s: float
    """Simulated duration, including arming."""
    wall_s: float
    """Wall-clock duration."""

    def values(self) -> dict[str, Any]:
        """Return the results as a dictionary."""
        return dataclasses.asdict(self)


class HoldPosition:
    """Guidance that holds a position and heading."""

    def __init__(self, place: Vector, settings: DynamicsSettings, heading: float = 0.0) -> None:
        """Take the position in metres, world frame; shape (3,)."""
        self.place = place
        self.settings = settings
        self.heading = heading

    def __call__(self, body: BodyState, readings: Readings) -> Setpoint:
        """See `Guidance`."""
        del body
        return Setpoint(velocity_to(self.place, readings, self.settings), self.heading)


class FollowPath:
    """Guidance to a point that moves along a path at constant speed."""

    def __init__(self, path: Sequence[Vector], speed: float, settings: DynamicsSettings) -> None:
        """Take the corners, in metres, world frame; each of shape (3,)."""
        self.path = np.array(path)
        self.speed = speed
        self.settings = settings
        steps = np.linalg.norm(np.diff(self.path, axis=0), axis=1)
        self._until = np.concatenate([[0.0], np.cumsum(steps)])
        self._begin: float | None = None

    @property
    def seconds(self) -> float:
        """Duration of the path."""
        return float(self._until[-1]) / self.speed

    def __call__(self, body: BodyState, readings: Readings) -> Setpoint:
        """See `Guidance`; the path begins with the first call."""
        del body
        if self._begin is None:
            self._begin = readings.time
        place, ahead = self._point(readings.time - self._begin)
        back = np.array(velocity_to(place, readings, self.settings))
        x, y, z = (float(v) for v in back + ahead)
        return Setpoint((x, y, z))

    def _point(self, seconds: float) -> tuple[Vector, Vector]:
        """Return position and velocity of the point. Shapes: (3,)."""
        along = seconds * self.speed
        leg = int(np.searchsorted(self._until, along, side="right")) - 1
        if leg >= len(self.path) - 1:
            return self.path[-1], np.zeros(3)
        way = self.path[leg + 1] - self.path[leg]
        direction = way / np.linalg.norm(way)
        return self.path[leg] + direction * (along - self._until[leg]), direction * self.speed


def fly_course(drone: DroneInTheLoop[Any], course: Course | None = None) -> CourseReport:
    """Arm, take off, hover, fly a square and land.

    Args:
        drone: A drone on the ground.
        course: Settings.

    Raises:
        FlightControllerError: It doesn't arm, reach its height or land; or the firmware failed.
    """
    course = course or Course()
    begin, settings, ground = time.monotonic(), drone.settings, drone.readings.position
    drone.arm()
    above = ground + np.array([0.0, 0.0, course.height])
    take_off(drone, above)
    hover = _fly(drone, HoldPosition(above, settings), course.hover)
    path = square(above, course.side)
    follow = FollowPath(path, course.speed, settings)
    square_flown = _fly(drone, follow, follow.seconds)
    _fly(drone, HoldPosition(above, settings), _SETTLING)
    land(drone, ground)
    counted = [m for m in hover if m.time >= hover[0].time + _SETTLING] or hover
    errors = np.array([distance_from(path, m.position) for m in square_flown])
    return CourseReport(
        hover_error_m=float(np.mean([np.linalg.norm(m.position - above) for m in counted])),
        path_error_m=float(errors.mean()),
        path_error_max_m=float(errors.max()),
        landing_error_m=float(np.linalg.norm((drone.readings.position - ground)[:2])),
        simulated_s=drone.time,
        wall_s=time.monotonic() - begin,
    )


def take_off(drone: DroneInTheLoop[Any], above: Vector, within: float = 10.0) -> None:
    """Climb to a position above an armed drone.

    Raises:
        FlightControllerError: It isn't reached within so many seconds.
    """
    hold = HoldPosition(above, drone.settings)
    if not drone.fly(hold, within, until=lambda s: abs(s.position[2] - above[2]) < 0.3):
        height = float(drone.readings.position[2])
        raise FlightControllerError(
            f"take-off: at {height:.2f} m, not {above[2]:.2f} m, after {within:g} s"
        )


def land(drone: DroneInTheLoop[Any], ground: Vector, within: float = 20.0) -> None:
    """Descend over a position, stop the rotors and disarm.

    Args:
        drone: A flying drone.
        ground: Position on the ground. Shape: (3,).
        within: Greatest duration, seconds.

    Raises:
        FlightControllerError: The drone isn't on the ground in time.
    """
    hold = HoldPosition(ground, drone.settings)

    def descend(body: BodyState, readings: Readings) -> Setpoint:
        forward, left, _ = hold(body, readings).velocity
        return Setpoint((forward, left, -LANDING_SPEED))

    low = ground[2] + _NEAR_GROUND
    if not drone.fly(descend, within, until=lambda s: bool(s.position[2] < low)):
        raise FlightControllerError(
            f"landing: still {drone.readings.position[2]:.2f} m up after {within:g} s"
        )
    drone.disarm()


def square(corner: Vector, side: float) -> list[Vector]:
    """Return a square's corners and the first again: forward, left, back, right."""
    steps = ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0))
    return [corner + np.array([x, y, 0.0]) for x, y in steps]


def distance_from(path: Sequence[Vector], place: Vector) -> float:
    """Return the distance of a position from a path, metres."""
    least = math.inf
    for start, end in itertools.pairwise(path):
        way = end - start
        along = float(np.clip((place - start) @ way / (way @ way), 0.0, 1.0))
        least = min(least, float(np.linalg.norm(place - start - along * way)))
    return least


def _fly(drone: DroneInTheLoop[Any], guidance: Guidance[Any], seconds: float) -> list[TraceSample]:
    """Fly and return the trace of this part."""
    first = len(drone.trace)
    drone.fly(guidance, seconds)
    return drone.trace[first:]
