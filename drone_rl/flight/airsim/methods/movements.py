"""Methods that move a vehicle: they are answered when the movement ends.

Clients send NED, radians, and degrees for headings; `Pilot` takes our world and degrees.
"""

import functools
import math
from collections.abc import Callable
from typing import Any

from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.messages import (
    FARTHEST,
    MOST_TURN,
    ned,
    number,
    read_drivetrain,
    read_map,
    read_path,
    read_seconds,
    read_yaw_mode,
    to_world,
)
from drone_rl.flight.airsim.methods.registry import Argument, given, method, vehicle_method
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.commands.path_following import AUTOMATIC, Drivetrain
from drone_rl.flight.commands.pilot import Sticks
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.utils.errors import InputError

_FASTEST = 100.0
"""Metres per second."""


def _speed(value: Any, name: str) -> float:
    """Return a speed, limited; raise an `InputError` if it is not above 0: none ever arrives."""
    if (speed := number(value, name, -_FASTEST, _FASTEST)) <= 0:
        raise InputError(f"{name}={speed:g} is invalid; give a speed above 0 (m/s)")
    return speed


def _degrees(value: Any, name: str, most: float) -> float:
    """Return an angle, or a rate, of at most so many radians in degrees."""
    return math.degrees(number(value, name, -most, most))


def _yaw(value: Any, name: str) -> float:
    return math.remainder(math.degrees(number(value, name)), 360.0)


def _heading(value: Any, name: str) -> float:
    return math.remainder(number(value, name), 360.0)


def _each(names: str, read: Callable[..., float], *limits: float) -> dict[str, Argument]:
    return {name: given(read, name, *limits) for name in names.split()}


_ARGUMENTS = {
    **_each("vx vy vz", number, -_FASTEST, _FASTEST),
    **_each("x y z z_min altitude", number, -FARTHEST, FARTHEST),
    **_each("throttle front_right rear_left front_left rear_right", number, 0.0, 1.0),
    **_each("latitude", number, -90.0, 90.0),
    **_each("longitude", number, -360.0, 360.0),
    **_each("vx_max vy_max", _speed),
    **_each("roll pitch", _degrees, math.pi / 2),
    **_each("roll_rate pitch_rate yaw_rate", _degrees, math.radians(MOST_TURN)),
    **_each("yaw", _yaw),
    **_each("duration", read_seconds),
    "heading": given(_heading, "yaw"),
    "rate": given(number, "yaw_rate", -MOST_TURN, MOST_TURN),
    "margin": given(number, "margin", 0.1, 180.0, default=5.0),
    "speed": given(_speed, "velocity"),
    "timeout": given(read_seconds, "timeout_sec", default=1e6),
    "path": given(read_path, "path"),
    "drivetrain": given(read_drivetrain, "drivetrain", default=0),
    "yaw_mode": given(read_yaw_mode, "yaw_mode", default={"is_rate": True, "yaw_or_rate": 0.0}),
    "lookahead": given(number, "lookahead", -FARTHEST, FARTHEST, default=AUTOMATIC),
    "adaptive_lookahead": given(number, "adaptive_lookahead", 0.0, 100.0, default=1.0),
}
"""How the arguments of movements are read."""
_OPTIONS = "speed timeout drivetrain yaw_mode lookahead adaptive_lookahead"
_Start = Callable[..., Any]


def _movement(names: str, sent: str, **defaults: Any) -> Callable[[_Start], _Start]:
    """Register a function that starts a movement of a vehicle, unless its API control is off.

    It takes the vehicle, and by name the arguments `sent` by clients, which are in this order.
    """
    keys = sent.split()
    arguments = {key: _ARGUMENTS[key] for key in keys}
    for key, default in defaults.items():
        arguments[key] = arguments[key]._replace(default=default)

    def register(start: _Start) -> _Start:
        @vehicle_method(names, *arguments.values())
        def run(vehicle: Vehicle, *values: Any) -> Any:
            if vehicle.has_api_control:
                return start(vehicle, **dict(zip(keys, values, strict=True)))
            remark("ignored, because API control is off; call enableApiControl(True)")
            return False

        return start

    return register


_movement("takeoff", "timeout", timeout=20.0)(Vehicle.take_off)
_movement("land", "timeout", timeout=60.0)(Vehicle.land)
_movement("goHome", "timeout")(Vehicle.go_home)
_movement("hover", "")(Vehicle.hover)
_movement("rotateByYawRate", "rate duration")(Vehicle.rotate_by)


@_movement("rotateToYaw", "heading timeout margin")
def _turn_to(vehicle: Vehicle, heading: float, **options: Any) -> Any:
    return vehicle.rotate_to(heading, **options)


@_movement("moveByManual", "vx_max vy_max z_min duration drivetrain yaw_mode")
def _move_manually(
    vehicle: Vehicle, vx_max: float, vy_max: float, z_min: float, **options: Any
) -> Any:
    return vehicle.move_by_manual(vx_max, vy_max, max(0.0, -z_min), **options)


@_movement("moveOnPath", f"path {_OPTIONS}")
def _move_on_path(vehicle: Vehicle, path: Any, **options: Any) -> Any:
    return vehicle.move_along([vehicle.world(point) for point in path], **options)


@_movement("moveToPosition", f"x y z {_OPTIONS}")
def _move_to(vehicle: Vehicle, x: float, y: float, z: float, **options: Any) -> Any:
    return _move_on_path(vehicle, [(x, y, z)], **options)


@_movement("moveToZ", "z speed timeout yaw_mode lookahead adaptive_lookahead")
def _move_to_z(vehicle: Vehicle, z: float, **options: Any) -> Any:
    x, y, _ = vehicle.pose.position
    return _move_to(vehicle, x, y, z, **options)


@_movement("moveToGPS", f"latitude longitude altitude {_OPTIONS}")
def _move_to_place(
    vehicle: Vehicle, latitude: float, longitude: float, altitude: float, **options: Any
) -> Any:
    place = vehicle.from_geo(GeoPoint(latitude, longitude, altitude))
    return _move_on_path(vehicle, [ned(place - vehicle.home)], **options)


def _move_by_velocity(
    vehicle: Vehicle,
    vx: float,
    vy: float,
    duration: float,
    drivetrain: Drivetrain,
    vz: float = 0.0,
    z: float | None = None,
    *,
    in_body: bool,
    **options: Any,
) -> Any:
    if duration <= 0.0:
        return z is None  # as AirSim answers
    velocity, frame = to_world((vx, vy, vz)), "body" if in_body else "world"
    if in_body and drivetrain == Drivetrain.FORWARD_ONLY:
        velocity, frame = vehicle.turned(*velocity), "world"
    return vehicle.move_by_velocity(
        *velocity,
        duration,
        z=vehicle.height(z),
        frame=frame,
        drivetrain=drivetrain,
        **options,
    )


for _names, _sent in (("moveByVelocity", "vx vy vz"), ("moveByVelocityZ", "vx vy z")):
    for _in_body, _frame in ((False, ""), (True, "BodyFrame")):
        _movement(f"{_names}{_frame}", f"{_sent} duration drivetrain yaw_mode")(
            functools.partial(_move_by_velocity, in_body=_in_body)
        )


def _tilt(vehicle: Vehicle, z: float | None = None, **values: Any) -> Any:
    return vehicle.move_by_angle(z=vehicle.height(z), **values)


def _spin(
    vehicle: Vehicle,
    roll_rate: float,
    pitch_rate: float,
    yaw_rate: float,
    duration: float,
    z: float | None = None,
    throttle: float | None = None,
) -> Any:
    rates = roll_rate, pitch_rate, yaw_rate
    return vehicle.move_by_rates(*rates, duration, z=vehicle.height(z), throttle=throttle)


def _set_rotors(vehicle: Vehicle, duration: float, **shares: float) -> Any:
    return vehicle.move_by_rotors([*shares.values()], duration)


for _start, _names, _sent in (
    (_set_rotors, "moveByMotorPWMs", "front_right rear_left front_left rear_right"),
    (_spin, "moveByAngleRatesZ", "roll_rate pitch_rate yaw_rate z"),
    (_spin, "moveByAngleRatesThrottle", "roll_rate pitch_rate yaw_rate throttle"),
    (_tilt, "moveByRollPitchYawZ", "roll pitch yaw z"),
    (_tilt, "moveByRollPitchYawThrottle", "roll pitch yaw throttle"),
    (_tilt, "moveByRollPitchYawrateZ", "roll pitch yaw_rate z"),
    (_tilt, "moveByRollPitchYawrateThrottle", "roll pitch yaw_rate throttle"),
    # versions up to 1.5
    (_tilt, "moveByAngleZ moveByAngle", "pitch roll z yaw"),
    (_tilt, "moveByAngleThrottle", "pitch roll throttle yaw_rate"),
):
    _movement(_names, f"{_sent} duration")(_start)


@method("waitOnLastTask")
def _wait_on_last(simulation: Simulation) -> Any:
    return simulation.find("").running or True


_STICKS = ("pitch", "roll", "throttle", "yaw")


@vehicle_method("moveByRC setRCData", given(read_map, "rcdata", _STICKS, 1.0))
def _by_rc(vehicle: Vehicle, values: list[float]) -> None:
    vehicle.sticks = Sticks(*values)
