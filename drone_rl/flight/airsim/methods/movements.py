"""Methods that move a vehicle: they are answered when the movement ends."""

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

from drone_rl.flight.airsim.messages import (
    FARTHEST,
    MOST_TURN,
    number,
    read_drivetrain,
    read_map,
    read_path,
    read_seconds,
    read_yaw_mode,
)
from drone_rl.flight.airsim.methods.registry import Argument, given, method, vehicle_method
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.commands.path_following import AUTOMATIC
from drone_rl.flight.commands.pilot import Sticks
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.utils.errors import InputError

_FASTEST = 100.0
"""Metres per second."""
_QUARTER, _TURN = math.pi / 2, math.radians(MOST_TURN)


def _limits(names: str, low: float, high: float) -> dict[str, tuple[float, float]]:
    return dict.fromkeys(names.split(), (low, high))


_LIMITS = {
    **_limits("vx vy vz", -_FASTEST, _FASTEST),
    **_limits("x y z z_min altitude", -FARTHEST, FARTHEST),
    **_limits("roll pitch", -_QUARTER, _QUARTER),
    **_limits("roll_rate pitch_rate yaw_rate", -_TURN, _TURN),
    **_limits("throttle front_right rear_left front_left rear_right", 0.0, 1.0),
    "latitude": (-90.0, 90.0),
    "longitude": (-360.0, 360.0),
}
"""Lowest and highest values of arguments, by name: metres, seconds, radians."""


def _speed(value: Any, name: str) -> float:
    """Return a speed, limited; raise an `InputError` if it is not above 0: none ever arrives."""
    if (speed := number(value, name, -_FASTEST, _FASTEST)) <= 0:
        raise InputError(f"{name}={speed:g} is invalid; give a speed above 0 (m/s)")
    return speed


_READERS: Mapping[str, Callable[..., float]] = dict.fromkeys(
    ("velocity", "vx_max", "vy_max"), _speed
)
"""Readers of arguments, by name, where not every number is one."""


def _numbers(names: str) -> list[Argument]:
    return [
        given(_READERS.get(name, number), name, *_LIMITS.get(name, ())) for name in names.split()
    ]


def _timeout(default: float = 1e6) -> Argument:
    return given(read_seconds, "timeout_sec", default=default)


_DURATION = given(read_seconds, "duration")
_YAW_MODE = given(read_yaw_mode, "yaw_mode", default={"is_rate": True, "yaw_or_rate": 0.0})
_HEADING = (given(read_drivetrain, "drivetrain", default=0), _YAW_MODE)
_LOOKAHEAD = (
    given(number, "lookahead", -FARTHEST, FARTHEST, default=AUTOMATIC),
    given(number, "adaptive_lookahead", 0.0, 100.0, default=1.0),
)
_STICKS = ("pitch", "roll", "throttle", "yaw")
_TO_POINT = (*_numbers("velocity"), _timeout(), *_HEADING, *_LOOKAHEAD)

vehicle_method("takeoff", _timeout(20.0))(Vehicle.takeoff)
vehicle_method("land", _timeout(60.0))(Vehicle.land_down)
vehicle_method("goHome", _timeout())(Vehicle.return_home)
vehicle_method("hover")(Vehicle.hold)
vehicle_method("rotateToYaw", *_numbers("yaw"), _timeout(), given(number, "margin", default=5.0))(
    Vehicle.turn_to
)
vehicle_method("rotateByYawRate", given(number, "yaw_rate", -MOST_TURN, MOST_TURN), _DURATION)(
    Vehicle.turn_by
)
vehicle_method("moveByManual", *_numbers("vx_max vy_max z_min"), _DURATION, *_HEADING)(
    Vehicle.move_manually
)
vehicle_method("moveOnPath", given(read_path, "path"), *_TO_POINT)(Vehicle.move_path)
vehicle_method("moveToZ", *_numbers("z velocity"), _timeout(), _YAW_MODE, *_LOOKAHEAD)(
    Vehicle.move_height
)


@vehicle_method("moveToPosition", *_numbers("x y z"), *_TO_POINT)
def _move_to(vehicle: Vehicle, x: float, y: float, z: float, *more: Any) -> Any:
    return vehicle.move_path([(x, y, z)], *more)


@vehicle_method("moveToGPS", *_numbers("latitude longitude altitude"), *_TO_POINT)
def _move_to_place(vehicle: Vehicle, north: float, east: float, up: float, *more: Any) -> Any:
    return vehicle.move_geo(GeoPoint(north, east, up), *more)


def _move_by_velocity(
    vehicle: Vehicle, vx: float, vy: float, third: float, *more: Any, at_height: bool, in_body: bool
) -> Any:
    if more[0] <= 0.0:  # the duration
        return not at_height  # as AirSim answers
    vz, z = (0.0, third) if at_height else (third, None)
    return vehicle.move_velocity((vx, vy, vz), *more, z=z, in_body=in_body)


for _at_height, _label, _names in ((False, "", "vx vy vz"), (True, "Z", "vx vy z")):
    for _in_body, _frame in ((False, ""), (True, "BodyFrame")):
        vehicle_method(f"moveByVelocity{_label}{_frame}", *_numbers(_names), _DURATION, *_HEADING)(
            functools.partial(_move_by_velocity, at_height=_at_height, in_body=_in_body)
        )


def _named(vehicle: Vehicle, *values: float, move: Any, names: str) -> Any:
    *held, seconds = values
    return move(vehicle, seconds, **dict(zip(names.split(), held, strict=True)))


for _move, _label, _names in (
    (Vehicle.set_rotors, "moveByMotorPWMs", "front_right rear_left front_left rear_right"),
    (Vehicle.spin, "moveByAngleRatesZ", "roll_rate pitch_rate yaw_rate z"),
    (Vehicle.spin, "moveByAngleRatesThrottle", "roll_rate pitch_rate yaw_rate throttle"),
    (Vehicle.tilt, "moveByRollPitchYawZ", "roll pitch yaw z"),
    (Vehicle.tilt, "moveByRollPitchYawThrottle", "roll pitch yaw throttle"),
    (Vehicle.tilt, "moveByRollPitchYawrateZ", "roll pitch yaw_rate z"),
    (Vehicle.tilt, "moveByRollPitchYawrateThrottle", "roll pitch yaw_rate throttle"),
    # versions up to 1.5
    (Vehicle.tilt, "moveByAngleZ moveByAngle", "pitch roll z yaw"),
    (Vehicle.tilt, "moveByAngleThrottle", "pitch roll throttle yaw_rate"),
):
    vehicle_method(_label, *_numbers(_names), _DURATION)(
        functools.partial(_named, move=_move, names=_names)
    )


@method("waitOnLastTask")
def _wait_on_last(simulation: Simulation) -> Any:
    return simulation.find("").running or True


@vehicle_method("moveByRC setRCData", given(read_map, "rcdata", _STICKS, 1.0))
def _by_rc(vehicle: Vehicle, values: list[float]) -> None:
    vehicle.sticks = Sticks(*values)
