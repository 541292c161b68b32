"""A trial flight of a flight controller: hover, fly a square, land; and its errors."""

import dataclasses
import time

import numpy as np

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.path_following import Path
from drone_rl.flight.in_the_loop.control import Setpoint, velocity_to
from drone_rl.flight.in_the_loop.drone import DroneInTheLoop, FlightControllerError, Guidance
from drone_rl.flight.in_the_loop.instruments import Readings, Vector
from drone_rl.sim.dynamics import FlightState
from drone_rl.utils.schema import Real

DESCENT_SPEED = 0.5
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
    """Seconds of hovering; the first three are not measured, unless there are no more."""

    def __post_init__(self) -> None:
        """Check the numbers; an `InputError` names the first that is out of range."""
        for field in dataclasses.fields(self):
            Real(0.1, 1000.0).read(getattr(self, field.name), field.name)


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


def hold_position(place: Vector, settings: DynamicsSettings) -> Guidance:
    """Return guidance that holds a position (metres, world frame; shape (3,)), facing along x."""
    return lambda body, readings: Setpoint(velocity_to(place, readings, settings))


def follow_path(path: Path, speed: float, settings: DynamicsSettings) -> Guidance:
    """Return guidance to a point that moves along a path from the first call.

    The speed in metres per second is constant.
    """
    begin: float | None = None

    def guide(body: FlightState, readings: Readings) -> Setpoint:
        nonlocal begin
        begin = readings.time if begin is None else begin
        along = (readings.time - begin) * speed
        ahead = speed * path.direction_at(along) if along < path.length else np.zeros(3)
        x, y, z = (velocity_to(path.place_at(along), readings, settings) + ahead).tolist()
        return Setpoint((x, y, z))

    return guide


def fly_course(drone: DroneInTheLoop, course: Course | None = None) -> CourseReport:
    """Arm a drone on the ground, take off, hover, fly a square and land.

    Raises:
        FlightControllerError: It doesn't arm, reach its height or land; or the firmware failed.
    """
    course = course or Course()
    begin, settings, ground = time.monotonic(), drone.settings, drone.readings.position
    drone.arm()
    above = ground + np.array([0.0, 0.0, course.height])
    take_off(drone, above)
    hold = hold_position(above, settings)
    hover = _fly(drone, hold, course.hover)
    path = Path(square(above, course.side))
    follow = follow_path(path, course.speed, settings)
    measured = _fly(drone, follow, 4.0 * course.side / course.speed)
    _fly(drone, hold, _SETTLING)
    land(drone, ground)
    counted = [m for m in hover if m.time >= hover[0].time + _SETTLING] or hover
    errors = [path.distance_from(m.position) for m in measured]
    return CourseReport(
        hover_error_m=float(np.mean([np.linalg.norm(m.position - above) for m in counted])),
        path_error_m=float(np.mean(errors)),
        path_error_max_m=max(errors),
        landing_error_m=float(np.linalg.norm((drone.readings.position - ground)[:2])),
        simulated_s=drone.time,
        wall_s=time.monotonic() - begin,
    )


def take_off(drone: DroneInTheLoop, above: Vector, within: float = 10.0) -> None:
    """Climb towards a position above an armed drone, until its height is reached to 0.3 m.

    Raises:
        FlightControllerError: It isn't reached within so many seconds.
    """
    hold = hold_position(above, drone.settings)
    if not drone.fly(hold, within, until=lambda s: abs(s.position[2] - above[2]) < 0.3):
        height = float(drone.readings.position[2])
        raise FlightControllerError(
            f"take-off: at {height:.2f} m, not {above[2]:.2f} m, after {within:g} s"
        )


def land(drone: DroneInTheLoop, ground: Vector, within: float = 20.0) -> None:
    """Descend over a position on the ground, shape (3,), stop the rotors and disarm.

    Raises:
        FlightControllerError: The drone isn't on the ground within so many seconds.
    """
    hold = hold_position(ground, drone.settings)

    def descend(body: FlightState, readings: Readings) -> Setpoint:
        forward, left, _ = hold(body, readings).velocity
        return Setpoint((forward, left, -DESCENT_SPEED))

    low = ground[2] + _NEAR_GROUND
    if not drone.fly(descend, within, until=lambda s: bool(s.position[2] < low)):
        raise FlightControllerError(
            f"landing: still {drone.readings.position[2] - ground[2]:.2f} m up after {within:g} s"
        )
    drone.disarm()


def square(corner: Vector, side: float) -> Vector:
    """Return a square's corners and the first again: forward, left, back, right. Shape: (5, 3)."""
    steps = [[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0], [0, 0, 0]]
    return corner + np.array(steps)


def _fly(drone: DroneInTheLoop, guidance: Guidance, seconds: float) -> list[Readings]:
    """Fly and return the trace of this part."""
    first = len(drone.trace)
    drone.fly(guidance, seconds)
    return drone.trace[first:]
