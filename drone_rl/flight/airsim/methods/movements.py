"""Methods that move a vehicle: they are answered when the movement ends."""

import functools
import math
from collections.abc import Sequence
from typing import Any

from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.messages import MOST_TURN, number, read_path, read_yaw_mode
from drone_rl.flight.airsim.methods.registry import argument, method, vehicle_at
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.flight.airsim.vehicle import limit
from drone_rl.flight.commands.checks import FARTHEST
from drone_rl.flight.commands.command import FlightFuture
from drone_rl.flight.commands.path_following import AUTOMATIC
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.utils.errors import InputError

_FASTEST = 100.0
"""Metres per second."""
_SLOWEST = 0.001
_LIMITS = {
    **dict.fromkeys(("vx", "vy", "vz"), (-_FASTEST, _FASTEST)),
    **dict.fromkeys(("velocity", "vx_max", "vy_max"), (_SLOWEST, _FASTEST)),
    **dict.fromkeys(("x", "y", "z", "z_min", "altitude", "lookahead"), (-FARTHEST, FARTHEST)),
    **dict.fromkeys(("roll", "pitch"), (-math.pi / 2, math.pi / 2)),
    **dict.fromkeys(
        ("roll_rate", "pitch_rate", "yaw_rate"), (-math.radians(MOST_TURN), math.radians(MOST_TURN))
    ),
    **dict.fromkeys(
        ("throttle", "front_right", "rear_left", "front_left", "rear_right"), (0.0, 1.0)
    ),
    "adaptive_lookahead": (0.0, 100.0),
    "latitude": (-90.0, 90.0),
    "longitude": (-360.0, 360.0),
}
"""Lowest and highest values of arguments, by name: metres, seconds, radians."""


def _flown(future: FlightFuture | None) -> Any:
    """Return a wait for the end of a movement; False if API control is off."""
    if future is None:
        remark("ignored, because API control is off; call enableApiControl(True)")
        return False
    return Wait(lambda: future.done, lambda: future.result())


def _number(value: Any, name: str) -> float:
    return number(value, name, *_LIMITS.get(name, ()))


def _numbers(args: Sequence[Any], *names: str) -> list[float]:
    """Return the first arguments, one for each name, as numbers within `_LIMITS`."""
    return [_number(value, name) for value, name in zip(args, names, strict=False)]


@method("takeoff")
def _takeoff(simulation: Simulation, args: Sequence[Any]) -> Any:
    timeout = number(argument(args, 0, 20.0), "timeout_sec")
    return _flown(vehicle_at(simulation, args, 1).takeoff(timeout))


@method("land")
def _land(simulation: Simulation, args: Sequence[Any]) -> Any:
    timeout = number(argument(args, 0, 60.0), "timeout_sec")
    return _flown(vehicle_at(simulation, args, 1).land_down(timeout))


@method("goHome")
def _home(simulation: Simulation, args: Sequence[Any]) -> Any:
    # version 1.1 passes nothing
    timeout = number(argument(args, 0, 1e6), "timeout_sec")
    return _flown(vehicle_at(simulation, args, 1).return_home(timeout))


@method("hover")
def _hover(simulation: Simulation, args: Sequence[Any]) -> Any:
    return _flown(vehicle_at(simulation, args, 0).hold())


def _move_velocity(
    simulation: Simulation, args: Sequence[Any], *, has_height: bool, in_body: bool
) -> Any:
    third = "z" if has_height else "vz"
    vx, vy, vz, seconds = _numbers(args, "vx", "vy", third, "duration")
    if seconds <= 0.0:
        return not has_height  # as AirSim answers
    drivetrain, yaw = read_yaw_mode(argument(args, 5, _HELD), argument(args, 4, 0))
    vehicle = vehicle_at(simulation, args, 6)
    future = vehicle.move_velocity(
        (vx, vy, 0.0 if has_height else vz),
        limit(seconds),
        drivetrain,
        yaw,
        z=vz if has_height else None,
        in_body=in_body,
    )
    return _flown(future)


_HELD = {"is_rate": True, "yaw_or_rate": 0.0}

for _label, _has_height, _in_body in (
    ("moveByVelocity", False, False),
    ("moveByVelocityZ", True, False),
    ("moveByVelocityBodyFrame", False, True),
    ("moveByVelocityZBodyFrame", True, True),
):
    method(_label, least=4)(
        functools.partial(_move_velocity, has_height=_has_height, in_body=_in_body)
    )


def _lookahead(args: Sequence[Any], index: int) -> tuple[float, float]:
    lookahead = _number(argument(args, index, AUTOMATIC), "lookahead")
    return lookahead, _number(argument(args, index + 1, 1.0), "adaptive_lookahead")


@method("moveOnPath", least=2)
def _move_path(simulation: Simulation, args: Sequence[Any]) -> Any:
    speed, timeout = _number(args[1], "velocity"), number(argument(args, 2, 1e6), "timeout_sec")
    drivetrain, yaw = read_yaw_mode(argument(args, 4, _HELD), argument(args, 3, 0))
    vehicle = vehicle_at(simulation, args, 7)
    path = read_path(args[0])
    ahead = _lookahead(args, 5)
    return _flown(vehicle.move_path(path, speed, timeout, drivetrain, yaw, *ahead))


@method("moveToPosition", least=4)
def _move_to(simulation: Simulation, args: Sequence[Any]) -> Any:
    x, y, z, speed = _numbers(args, "x", "y", "z", "velocity")
    timeout = number(argument(args, 4, 1e6), "timeout_sec")
    drivetrain, yaw = read_yaw_mode(argument(args, 6, _HELD), argument(args, 5, 0))
    vehicle = vehicle_at(simulation, args, 9)
    future = vehicle.move_path([(x, y, z)], speed, timeout, drivetrain, yaw, *_lookahead(args, 7))
    return _flown(future)


@method("moveToGPS", least=4)
def _move_geo(simulation: Simulation, args: Sequence[Any]) -> Any:
    *place, speed = _numbers(args, "latitude", "longitude", "altitude", "velocity")
    timeout = number(argument(args, 4, 1e6), "timeout_sec")
    drivetrain, yaw = read_yaw_mode(argument(args, 6, _HELD), argument(args, 5, 0))
    vehicle = vehicle_at(simulation, args, 9)
    ahead = _lookahead(args, 7)
    return _flown(vehicle.move_geo(GeoPoint(*place), speed, timeout, drivetrain, yaw, *ahead))


@method("moveToZ", least=2)
def _move_z(simulation: Simulation, args: Sequence[Any]) -> Any:
    z, speed = _numbers(args, "z", "velocity")
    timeout = number(argument(args, 2, 1e6), "timeout_sec")
    _, yaw = read_yaw_mode(argument(args, 3, _HELD), 0)
    vehicle = vehicle_at(simulation, args, 6)
    return _flown(vehicle.move_height(z, speed, timeout, yaw, *_lookahead(args, 4)))


@method("rotateToYaw", least=1)
def _rotate_to(simulation: Simulation, args: Sequence[Any]) -> Any:
    yaw, timeout = number(args[0], "yaw"), number(argument(args, 1, 1e6), "timeout_sec")
    margin = number(argument(args, 2, 5.0), "margin")
    return _flown(vehicle_at(simulation, args, 3).turn_to(yaw, timeout, margin))


@method("rotateByYawRate", least=2)
def _rotate_by(simulation: Simulation, args: Sequence[Any]) -> Any:
    rate, seconds = number(args[0], "yaw_rate", -MOST_TURN, MOST_TURN), number(args[1], "duration")
    if seconds <= 0.0:
        return True
    future = vehicle_at(simulation, args, 2).turn_by(rate, limit(seconds))
    return _flown(future)


@method("moveByManual", least=4)
def _manual(simulation: Simulation, args: Sequence[Any]) -> Any:
    vx, vy, z, seconds = _numbers(args, "vx_max", "vy_max", "z_min", "duration")
    drivetrain, yaw = read_yaw_mode(argument(args, 5, _HELD), argument(args, 4, 0))
    vehicle = vehicle_at(simulation, args, 6)
    future = vehicle.move_manually(vx, vy, z, limit(seconds), drivetrain, yaw)
    return _flown(future)


@method("waitOnLastTask")
def _wait_on_last(simulation: Simulation, args: Sequence[Any]) -> Any:
    future = simulation.find("").running
    return True if future is None else _flown(future)


@method("moveByRC", "setRCData", least=1)
def _by_rc(simulation: Simulation, args: Sequence[Any]) -> None:
    if not isinstance(args[0], dict):
        raise InputError("rcdata is not a map; give RCData")
    vehicle_at(simulation, args, 1).set_sticks(args[0])


def _tilt(simulation: Simulation, args: Sequence[Any], *, order: str) -> Any:
    names = order.split()
    *values, seconds = _numbers(args, *names, "duration")
    held = dict(zip(names, values, strict=True))
    vehicle = vehicle_at(simulation, args, 5)
    return _flown(vehicle.tilt(seconds=limit(seconds), **held))


for _label, _order in (
    ("moveByRollPitchYawZ", "roll pitch yaw z"),
    ("moveByRollPitchYawThrottle", "roll pitch yaw throttle"),
    ("moveByRollPitchYawrateZ", "roll pitch yaw_rate z"),
    ("moveByRollPitchYawrateThrottle", "roll pitch yaw_rate throttle"),
    # versions up to 1.5
    ("moveByAngleZ", "pitch roll z yaw"),
    ("moveByAngle", "pitch roll z yaw"),
    ("moveByAngleThrottle", "pitch roll throttle yaw_rate"),
):
    method(_label, least=5)(functools.partial(_tilt, order=_order))


def _spin(simulation: Simulation, args: Sequence[Any], *, lift: str) -> Any:
    names = ("roll_rate", "pitch_rate", "yaw_rate", lift, "duration")
    *rates, value, seconds = _numbers(args, *names)
    vehicle = vehicle_at(simulation, args, 5)
    return _flown(vehicle.spin(rates, limit(seconds), **{lift: value}))


for _label, _lift in (("moveByAngleRatesZ", "z"), ("moveByAngleRatesThrottle", "throttle")):
    method(_label, least=5)(functools.partial(_spin, lift=_lift))


@method("moveByMotorPWMs", least=5)
def _motors(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("front_right", "rear_left", "front_left", "rear_right", "duration")
    *shares, seconds = _numbers(args, *names)
    vehicle = vehicle_at(simulation, args, 5)
    return _flown(vehicle.set_rotors(shares, limit(seconds)))
