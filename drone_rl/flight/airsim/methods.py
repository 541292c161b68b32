"""The RPC methods of AirSim's clients: versions 1.1, 1.2 to 1.8, and Cosys-AirSim 3.5.

A method is found by its name. What dialect a call is in shows in its arguments: version 1.1 names
no vehicle, and images are requested by camera numbers; Cosys' requests have an annotation name.
"""

import dataclasses
import functools
import logging
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import torch

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import (
    NO_POSE,
    Map,
    flag,
    number,
    read_map,
    read_path,
    read_pose,
    read_vector,
    read_yaw_mode,
    text,
    to_world,
    whole,
)
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.flight.airsim.stage import png
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.commands.command import FlightFuture
from drone_rl.flight.commands.path_following import AUTOMATIC
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.sim.entities import find_camera
from drone_rl.sim.image_types import ImageType
from drone_rl.sim.rendering.appearance import product, rotate
from drone_rl.utils.errors import InputError, did_you_mean

_log = logging.getLogger(__name__)

SERVER_VERSION, MIN_CLIENT_VERSION = 4, 1
"""Versions that clients 1.2 to 1.8 and Cosys 3.5 accept without a warning."""
MAX_IMAGES = 64
"""Images in one call."""


@dataclasses.dataclass(frozen=True)
class Method:
    """How a method is called and computed."""

    compute: Callable[..., Any]
    least: int
    """Fewest arguments; more than all are ignored."""


class UnknownMethodError(Exception):
    """There is no such method."""


METHODS: dict[str, Method] = {}
"""All methods, by their names."""

UNSUPPORTED = {
    "simGetLidarSegmentation": "lidar",
    "getLidarData": "lidar; use depth images by simGetImages",
    "getDistanceSensorData": "distance sensors; use depth images by simGetImages",
    "setCarControls": "cars; use a multirotor",
    "getCarState": "cars; use getMultirotorState",
    "getCarControls": "cars; use a multirotor",
    "simSetObjectMaterial": "materials of Unreal; set appearance when the server starts",
    "simSetObjectMaterialFromTexture": "materials of Unreal; set appearance when the server starts",
    "simSwapTextures": "textures of Unreal; set appearance when the server starts",
    "simLoadLevel": "levels of Unreal; start a server with another scene",
    "simSpawnAsset": "assets of Unreal; simSpawnObject makes cubes, spheres and cylinders",
    "simGetMeshPositionVertexBuffers": "meshes of Unreal; give a scene as an MJCF file",
    "simSetObjectScale": "scaling; spawn an object of another size",
    "simCharSetFacePreset": "characters of Unreal",
    "simGetWorldExtents": "voxel grids",
    "simCreateVoxelGrid": "voxel grids; use depth images by simGetImages",
    "simSetKinematics": "setting velocities; use simSetVehiclePose",
    "simSetLightIntensity": "lights of Unreal; use simSetTimeOfDay",
    "simGetFilmbackSettings": "film cameras; use simSetCameraFov",
    "simSetFilmbackSettings": "film cameras; use simSetCameraFov",
    "simGetLensSettings": "film cameras; use simSetCameraFov",
    "simSetPresetLensSettings": "film cameras; use simSetCameraFov",
    "simSetFocalLength": "film cameras; use simSetCameraFov",
    "simGetFocalLength": "film cameras; use simGetCameraInfo",
    "simEnableManualFocus": "film cameras",
    "simSetFocusDistance": "film cameras",
    "simGetFocusDistance": "film cameras",
    "simSetFocusAperture": "film cameras",
    "simGetFocusAperture": "film cameras",
    "simEnableFocusPlane": "film cameras",
    "simGetCurrentFieldOfView": "film cameras; use simGetCameraInfo",
    "simSetDistortionParam": "lens distortion",
    "simGetDistortionParams": "lens distortion",
    "simAddDetectionFilterMeshName": "detections; use segmentation images",
    "simSetDetectionFilterRadius": "detections; use segmentation images",
    "simClearDetectionMeshNames": "detections; use segmentation images",
    "simGetDetections": "detections; use segmentation images",
    "simTestLineOfSightBetweenPoints": "places on Earth in rays; use simTestLineOfSightToPoint",
}
"""Methods that AirSim has and this server does not, with what is missing and the alternative."""


PARTLY = {
    "simSpawnObject": "cube, sphere or cylinder, four of each; vehicles fly through them",
    "simSetObjectPose": "positions, of the scene's objects, spawned ones and vehicles; no rotation",
    "simGetObjectScale": "always 1",
    "simSetWeatherParameter": "fog",
    "simSetTimeOfDay": "the sun's place at that hour, which then stands still",
    "simAddVehicle": "SimpleFlight and ComputerVision",
    "simRunConsoleCommand": "returns false",
    "simGetImages": "types 0 to 7; vehicles do not see each other",
    "simGetImage": "types 0 to 7; vehicles do not see each other",
    "simGetGroundTruthEnvironment": "the standard atmosphere",
    "simContinueForFrames": "a frame is a control period, 21 ms",
    "simTestLineOfSightToPoint": "boxes that can be touched hide; other objects do not",
    "simListAssets": "shapes for simSpawnObject",
    **dict.fromkeys(
        (
            "setAngleRateControllerGains",
            "setAngleLevelControllerGains",
            "setVelocityControllerGains",
            "setPositionControllerGains",
        ),
        "accepted, without effect: gains are settings of the dynamics",
    ),
    **dict.fromkeys(
        (
            *("simPrintLogMessage", "simSetTraceLine", "simFlushPersistentMarkers"),
            *("simPlotPoints", "simPlotLineStrip", "simPlotLineList", "simPlotArrows"),
            *("simPlotStrings", "simPlotTransforms", "simPlotTransformsWithNames"),
        ),
        "accepted, without effect: there is no window",
    ),
}
"""Methods that do not all that AirSim's do, with what they do."""


def method(*names: str, least: int = 0) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function of (simulation, arguments) under names of RPC methods."""

    def register(compute: Callable[..., Any]) -> Callable[..., Any]:
        METHODS.update(dict.fromkeys(names, Method(compute, least)))
        return compute

    return register


def call(simulation: Simulation, name: str, args: Sequence[Any]) -> Any:
    """Return the result of a call, or a `Wait` if it takes simulated time.

    Raises:
        UnknownMethodError: There is no such method.
        InputError: An argument is wrong, or the vehicle's state does not allow it.
    """
    found = METHODS.get(name)
    if found is None:
        if name in UNSUPPORTED:
            raise InputError(f"{name} is not supported: this server has no {UNSUPPORTED[name]}")
        raise UnknownMethodError(name)
    if len(args) < found.least:
        raise InputError(
            f"{name} was called with {len(args)} arguments; give {found.least} or more"
        )
    return found.compute(simulation, args)


def suggestion(name: str) -> str:
    """Return a hint at methods with a similar name."""
    return did_you_mean(name, METHODS)


def _at(args: Sequence[Any], index: int, default: Any = None) -> Any:
    return args[index] if len(args) > index else default


def _name(args: Sequence[Any], index: int) -> str:
    return text(_at(args, index, ""), "vehicle_name")


def _vehicle(simulation: Simulation, args: Sequence[Any], index: int) -> Vehicle:
    return simulation.find(_name(args, index))


def _posed(simulation: Simulation, args: Sequence[Any], index: int) -> Vehicle:
    return simulation.find(_name(args, index), is_pose=True)


def _flown(future: FlightFuture | None, name: str) -> Any:
    """Return a wait for the end of a movement; False if API control is off."""
    if future is None:
        _log.warning("%s is ignored: API control is off; call enableApiControl(True)", name)
        return False
    return Wait(lambda: future.done, lambda: future.result())


# Handshake


@method("ping")
def _ping(simulation: Simulation, args: Sequence[Any]) -> bool:
    return True


@method("getServerVersion")
def _server_version(simulation: Simulation, args: Sequence[Any]) -> int:
    return SERVER_VERSION


@method("getMinRequiredClientVersion")
def _client_version(simulation: Simulation, args: Sequence[Any]) -> int:
    return MIN_CLIENT_VERSION


@method("listVehicles")
def _list_vehicles(simulation: Simulation, args: Sequence[Any]) -> list[str]:
    return [*simulation.vehicles]


@method("getSettingsString")
def _settings_string(simulation: Simulation, args: Sequence[Any]) -> str:
    return simulation.settings.text


@method("isSimulationMode")
def _is_simulation(simulation: Simulation, args: Sequence[Any]) -> bool:
    return True


@method("getServerDebugInfo", "getDebugInfo")
def _debug_info(simulation: Simulation, args: Sequence[Any]) -> str:
    return ""


@method("timestampNow")
def _timestamp(simulation: Simulation, args: Sequence[Any]) -> int:
    return messages.nanoseconds(simulation.time)


# Control and clock


@method("enableApiControl", least=1)
def _enable(simulation: Simulation, args: Sequence[Any]) -> None:
    _vehicle(simulation, args, 1).allow(flag(args[0], "is_enabled"))


@method("isApiControlEnabled")
def _is_enabled(simulation: Simulation, args: Sequence[Any]) -> bool:
    return _vehicle(simulation, args, 0).has_api_control


@method("armDisarm", least=1)
def _arm(simulation: Simulation, args: Sequence[Any]) -> bool:
    return _vehicle(simulation, args, 1).set_armed(flag(args[0], "arm"))


@method("cancelLastTask")
def _cancel(simulation: Simulation, args: Sequence[Any]) -> None:
    _vehicle(simulation, args, 0).cancel()


@method("reset")
def _reset(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.reset()


@method("simPause", least=1)
def _pause(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.pause(flag(args[0], "is_paused"))


@method("simIsPause", "simIsPaused")
def _is_paused(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.is_paused


@method("simContinueForTime", least=1)
def _continue(simulation: Simulation, args: Sequence[Any]) -> Wait:
    return simulation.continue_for(number(args[0], "seconds", 0.0, 1e6))


@method("simContinueForFrames", least=1)
def _continue_frames(simulation: Simulation, args: Sequence[Any]) -> Wait:
    return simulation.continue_for(whole(args[0], "frames", 0, 10**6) * simulation.tick)


# Movements


@method("takeoff")
def _takeoff(simulation: Simulation, args: Sequence[Any]) -> Any:
    timeout = number(_at(args, 0, 20.0), "timeout_sec")
    return _flown(_vehicle(simulation, args, 1).takeoff(timeout), "takeoff")


@method("land")
def _land(simulation: Simulation, args: Sequence[Any]) -> Any:
    timeout = number(_at(args, 0, 60.0), "timeout_sec")
    return _flown(_vehicle(simulation, args, 1).land_down(timeout), "land")


@method("goHome")
def _home(simulation: Simulation, args: Sequence[Any]) -> Any:
    # version 1.1 passes nothing
    timeout = number(_at(args, 0, 1e6), "timeout_sec")
    return _flown(_vehicle(simulation, args, 1).return_home(timeout), "goHome")


@method("hover")
def _hover(simulation: Simulation, args: Sequence[Any]) -> Any:
    return _flown(_vehicle(simulation, args, 0).hold(), "hover")


def _move_velocity(
    simulation: Simulation, args: Sequence[Any], *, has_height: bool, in_body: bool, name: str
) -> Any:
    third = "z" if has_height else "vz"
    names = ("vx", "vy", third, "duration")
    vx, vy, vz, seconds = (number(v, n) for v, n in zip(args, names, strict=False))
    if seconds <= 0.0:
        return not has_height
    drivetrain, yaw = read_yaw_mode(_at(args, 5, _HELD), _at(args, 4, 0))
    vehicle = _vehicle(simulation, args, 6)
    future = vehicle.move_velocity(
        (vx, vy, 0.0 if has_height else vz),
        min(seconds, 1e6),
        drivetrain,
        yaw,
        z=vz if has_height else None,
        in_body=in_body,
    )
    return _flown(future, name)


_HELD = {"is_rate": True, "yaw_or_rate": 0.0}

for _label, _has_height, _in_body in (
    ("moveByVelocity", False, False),
    ("moveByVelocityZ", True, False),
    ("moveByVelocityBodyFrame", False, True),
    ("moveByVelocityZBodyFrame", True, True),
):
    method(_label, least=4)(
        functools.partial(_move_velocity, has_height=_has_height, in_body=_in_body, name=_label)
    )


def _lookahead(args: Sequence[Any], index: int) -> tuple[float, float]:
    lookahead = number(_at(args, index, AUTOMATIC), "lookahead")
    return lookahead, number(_at(args, index + 1, 1.0), "adaptive_lookahead")


@method("moveOnPath", least=2)
def _move_path(simulation: Simulation, args: Sequence[Any]) -> Any:
    speed, timeout = number(args[1], "velocity"), number(_at(args, 2, 1e6), "timeout_sec")
    drivetrain, yaw = read_yaw_mode(_at(args, 4, _HELD), _at(args, 3, 0))
    vehicle = _vehicle(simulation, args, 7)
    path = read_path(args[0])
    ahead = _lookahead(args, 5)
    return _flown(vehicle.move_path(path, speed, timeout, drivetrain, yaw, *ahead), "moveOnPath")


@method("moveToPosition", least=4)
def _move_to(simulation: Simulation, args: Sequence[Any]) -> Any:
    x, y, z, speed = (number(v, n) for v, n in zip(args, ("x", "y", "z", "velocity"), strict=False))
    timeout = number(_at(args, 4, 1e6), "timeout_sec")
    drivetrain, yaw = read_yaw_mode(_at(args, 6, _HELD), _at(args, 5, 0))
    vehicle = _vehicle(simulation, args, 9)
    future = vehicle.move_path([(x, y, z)], speed, timeout, drivetrain, yaw, *_lookahead(args, 7))
    return _flown(future, "moveToPosition")


@method("moveToGPS", least=4)
def _move_geo(simulation: Simulation, args: Sequence[Any]) -> Any:
    latitude = number(args[0], "latitude", -90.0, 90.0)
    longitude = number(args[1], "longitude", -360.0, 360.0)
    place = GeoPoint(latitude, longitude, number(args[2], "altitude"))
    speed, timeout = number(args[3], "velocity"), number(_at(args, 4, 1e6), "timeout_sec")
    drivetrain, yaw = read_yaw_mode(_at(args, 6, _HELD), _at(args, 5, 0))
    vehicle = _vehicle(simulation, args, 9)
    future = vehicle.move_geo(place, speed, timeout, drivetrain, yaw, *_lookahead(args, 7))
    return _flown(future, "moveToGPS")


@method("moveToZ", least=2)
def _move_z(simulation: Simulation, args: Sequence[Any]) -> Any:
    z, speed = number(args[0], "z"), number(args[1], "velocity")
    timeout = number(_at(args, 2, 1e6), "timeout_sec")
    _, yaw = read_yaw_mode(_at(args, 3, _HELD), 0)
    vehicle = _vehicle(simulation, args, 6)
    return _flown(vehicle.move_height(z, speed, timeout, yaw, *_lookahead(args, 4)), "moveToZ")


@method("rotateToYaw", least=1)
def _rotate_to(simulation: Simulation, args: Sequence[Any]) -> Any:
    yaw, timeout = number(args[0], "yaw"), number(_at(args, 1, 1e6), "timeout_sec")
    margin = number(_at(args, 2, 5.0), "margin")
    return _flown(_vehicle(simulation, args, 3).turn_to(yaw, timeout, margin), "rotateToYaw")


@method("rotateByYawRate", least=2)
def _rotate_by(simulation: Simulation, args: Sequence[Any]) -> Any:
    rate, seconds = number(args[0], "yaw_rate", -3600.0, 3600.0), number(args[1], "duration")
    if seconds <= 0.0:
        return True
    future = _vehicle(simulation, args, 2).turn_by(rate, min(seconds, 1e6))
    return _flown(future, "rotateByYawRate")


@method("moveByManual", least=4)
def _manual(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("vx_max", "vy_max", "z_min", "duration")
    vx, vy, z, seconds = (number(v, n) for v, n in zip(args, names, strict=False))
    drivetrain, yaw = read_yaw_mode(_at(args, 5, _HELD), _at(args, 4, 0))
    vehicle = _vehicle(simulation, args, 6)
    future = vehicle.move_manually(vx, vy, z, min(seconds, 1e6), drivetrain, yaw)
    return _flown(future, "moveByManual")


@method("moveByRC", least=1)
def _by_rc(simulation: Simulation, args: Sequence[Any]) -> None:
    if not isinstance(args[0], dict):
        raise InputError("rcdata is not a map; give RCData")
    _vehicle(simulation, args, 1).set_sticks(args[0])


def _numbers(args: Sequence[Any], *names: str) -> list[float]:
    return [number(value, name) for value, name in zip(args, names, strict=False)]


def _seconds(value: float) -> float:
    return min(max(value, 0.0), 1e6)


@method("moveByRollPitchYawZ", least=5)
def _roll_pitch_yaw_z(simulation: Simulation, args: Sequence[Any]) -> Any:
    roll, pitch, yaw, z, seconds = _numbers(args, "roll", "pitch", "yaw", "z", "duration")
    vehicle = _vehicle(simulation, args, 5)
    future = vehicle.tilt(roll, pitch, _seconds(seconds), yaw=yaw, z=z)
    return _flown(future, "moveByRollPitchYawZ")


@method("moveByRollPitchYawThrottle", least=5)
def _roll_pitch_yaw_throttle(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("roll", "pitch", "yaw", "throttle", "duration")
    roll, pitch, yaw, throttle, seconds = _numbers(args, *names)
    vehicle = _vehicle(simulation, args, 5)
    future = vehicle.tilt(roll, pitch, _seconds(seconds), yaw=yaw, throttle=throttle)
    return _flown(future, "moveByRollPitchYawThrottle")


@method("moveByRollPitchYawrateThrottle", least=5)
def _roll_pitch_yawrate_throttle(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("roll", "pitch", "yaw_rate", "throttle", "duration")
    roll, pitch, rate, throttle, seconds = _numbers(args, *names)
    vehicle = _vehicle(simulation, args, 5)
    future = vehicle.tilt(roll, pitch, _seconds(seconds), yaw_rate=rate, throttle=throttle)
    return _flown(future, "moveByRollPitchYawrateThrottle")


@method("moveByRollPitchYawrateZ", least=5)
def _roll_pitch_yawrate_z(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("roll", "pitch", "yaw_rate", "z", "duration")
    roll, pitch, rate, z, seconds = _numbers(args, *names)
    vehicle = _vehicle(simulation, args, 5)
    future = vehicle.tilt(roll, pitch, _seconds(seconds), yaw_rate=rate, z=z)
    return _flown(future, "moveByRollPitchYawrateZ")


@method("moveByAngleRatesZ", least=5)
def _rates_z(simulation: Simulation, args: Sequence[Any]) -> Any:
    *rates, z, seconds = _numbers(args, "roll_rate", "pitch_rate", "yaw_rate", "z", "duration")
    vehicle = _vehicle(simulation, args, 5)
    return _flown(vehicle.spin(rates, _seconds(seconds), z=z, throttle=None), "moveByAngleRatesZ")


@method("moveByAngleRatesThrottle", least=5)
def _rates_throttle(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("roll_rate", "pitch_rate", "yaw_rate", "throttle", "duration")
    *rates, throttle, seconds = _numbers(args, *names)
    vehicle = _vehicle(simulation, args, 5)
    future = vehicle.spin(rates, _seconds(seconds), z=None, throttle=throttle)
    return _flown(future, "moveByAngleRatesThrottle")


@method("moveByAngleZ", "moveByAngle", least=5)
def _angle_z(simulation: Simulation, args: Sequence[Any]) -> Any:
    """Move as versions up to 1.5 do: pitch comes first."""
    pitch, roll, z, yaw, seconds = _numbers(args, "pitch", "roll", "z", "yaw", "duration")
    vehicle = _vehicle(simulation, args, 5)
    return _flown(vehicle.tilt(roll, pitch, _seconds(seconds), yaw=yaw, z=z), "moveByAngleZ")


@method("moveByAngleThrottle", least=5)
def _angle_throttle(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("pitch", "roll", "throttle", "yaw_rate", "duration")
    pitch, roll, throttle, rate, seconds = _numbers(args, *names)
    vehicle = _vehicle(simulation, args, 5)
    future = vehicle.tilt(roll, pitch, _seconds(seconds), yaw_rate=rate, throttle=throttle)
    return _flown(future, "moveByAngleThrottle")


@method("moveByMotorPWMs", least=5)
def _motors(simulation: Simulation, args: Sequence[Any]) -> Any:
    names = ("front_right", "rear_left", "front_left", "rear_right", "duration")
    *shares, seconds = _numbers(args, *names)
    vehicle = _vehicle(simulation, args, 5)
    return _flown(vehicle.set_rotors(shares, _seconds(seconds)), "moveByMotorPWMs")


# State


@method("getMultirotorState")
def _state(simulation: Simulation, args: Sequence[Any]) -> Map:
    return _vehicle(simulation, args, 0).multirotor_state()


@method("simGetVehiclePose", "simGetPose")
def _pose(simulation: Simulation, args: Sequence[Any]) -> Map:
    return messages.pose(_posed(simulation, args, 0).pose)


@method("simSetVehiclePose", "simSetPose", least=2)
def _set_pose(simulation: Simulation, args: Sequence[Any]) -> None:
    vehicle = _posed(simulation, args, 2)
    ignore = flag(args[1], "ignore_collision")
    vehicle.set_airsim_pose(read_pose(args[0]), ignore_collision=ignore)
    simulation.stage.touch(vehicle.body.position[0])


@method("simGetGroundTruthKinematics")
def _kinematics(simulation: Simulation, args: Sequence[Any]) -> Map:
    return _posed(simulation, args, 0).kinematics()


@method("simGetGroundTruthEnvironment")
def _environment(simulation: Simulation, args: Sequence[Any]) -> Map:
    vehicle = _posed(simulation, args, 0)
    altitude = vehicle.geo_point()["altitude"]
    kelvin = 288.15 - 0.0065 * altitude
    pressure = 101325.0 * (kelvin / 288.15) ** 5.25588
    return {
        "position": messages.vector(vehicle.pose.position),
        "geo_point": vehicle.geo_point(),
        "gravity": messages.vector((0.0, 0.0, 9.80665)),
        "air_pressure": pressure,
        "temperature": kelvin,
        "air_density": pressure / (287.05 * kelvin),
    }


@method("simGetCollisionInfo", "getCollisionInfo")
def _collision(simulation: Simulation, args: Sequence[Any]) -> Map:
    return _posed(simulation, args, 0).collision()


@method("getRotorStates")
def _rotors(simulation: Simulation, args: Sequence[Any]) -> Map:
    return _vehicle(simulation, args, 0).rotor_states()


@method("simTestLineOfSightToPoint", least=1)
def _line_of_sight(simulation: Simulation, args: Sequence[Any]) -> bool:
    keys = ("latitude", "longitude", "altitude")
    place = GeoPoint(*read_map(args[0], "point", keys))
    return _posed(simulation, args, 1).sees(place)


@method("getHomeGeoPoint")
def _home_point(simulation: Simulation, args: Sequence[Any]) -> Map:
    _vehicle(simulation, args, 0)
    return messages.geo_point(simulation.settings.home)


def _legacy(compute: Callable[[Vehicle], Any]) -> Callable[[Simulation, Sequence[Any]], Any]:
    return lambda simulation, args: compute(simulation.find(""))


method("getPosition")(_legacy(lambda v: v.kinematics()["position"]))
method("getVelocity")(_legacy(lambda v: v.kinematics()["linear_velocity"]))
method("getOrientation")(_legacy(lambda v: v.kinematics()["orientation"]))
method("getLandedState")(_legacy(lambda v: v.multirotor_state()["landed_state"]))
method("getGpsLocation")(_legacy(lambda v: v.geo_point()))
method("getRCData")(_legacy(lambda v: v.multirotor_state()["rc_data"]))


def _sensor(kind: str) -> Callable[[Simulation, Sequence[Any]], Map]:
    # the first argument is the sensor's name; each vehicle has one of a kind
    return lambda simulation, args: _vehicle(simulation, args, 1).sensor(kind)


for _label in ("imu", "barometer", "magnetometer", "gps"):
    method(f"get{_label.title()}Data")(_sensor(_label))


# Images and cameras


def _camera(value: Any) -> str:
    """Return our name of a camera."""
    return find_camera(value if isinstance(value, int) else text(value, "camera_name")).name


@dataclasses.dataclass(frozen=True)
class _Request:
    camera: str
    given: Any
    """The camera as the client called it."""
    kind: ImageType
    is_float: bool
    is_compressed: bool
    channels: str
    """Order of a raw image's channels: "rgba" in version 1.1, "bgr", or Cosys' "rgb"."""


def _read_request(value: Any, channels: str | None = None) -> _Request:
    if not isinstance(value, dict):
        raise InputError(
            "an image request is not a map; give ImageRequest(camera, image_type, ...)"
        )
    given = {k.decode() if isinstance(k, bytes) else k: v for k, v in value.items()}
    legacy = "camera_id" in given
    if "image_type" not in given or not ("camera_name" in given or legacy):
        raise InputError("an image request has no camera_name or image_type; give both")
    camera = given["camera_id"] if legacy else given["camera_name"]
    order = "rgba" if legacy else "rgb" if "annotation_name" in given else "bgr"
    return _Request(
        _camera(camera),
        camera,
        _image_type(given["image_type"]),
        flag(given.get("pixels_as_float", False), "pixels_as_float"),
        flag(given.get("compress", True), "compress"),
        channels or order,
    )


def _image_type(value: Any) -> ImageType:
    found = whole(value, "image_type", 0, 10)
    if found == 7:  # infrared: the segmentation id as gray
        return ImageType.SEGMENTATION
    if found > ImageType.SURFACE_NORMALS:
        names = ", ".join(f"{kind.value} ({kind.name.lower()})" for kind in ImageType)
        raise InputError(f"image_type={found} is not supported; give one of: {names}")
    return ImageType(found)


@method("simGetImages", least=1)
def _images(simulation: Simulation, args: Sequence[Any]) -> list[Map]:
    if not isinstance(args[0], list | tuple) or len(args[0]) > MAX_IMAGES:
        raise InputError(f"requests are not a list of at most {MAX_IMAGES}; give ImageRequests")
    requests = [_read_request(value) for value in args[0]]
    name = _name(args, 1)
    vehicle = simulation.find(name, is_pose=True)
    cameras = simulation.cameras[vehicle.choice.name]
    found: list[Any] = [None] * len(requests)
    for camera in dict.fromkeys(request.camera for request in requests):
        rows = [i for i, request in enumerate(requests) if request.camera == camera]
        kinds = [requests[i].kind for i in rows]
        rendered = simulation.stage.render(vehicle.body, camera, cameras[camera], kinds)
        for i, one in zip(rows, rendered, strict=True):
            found[i] = _response(simulation, vehicle, requests[i], one)
    return found


def _response(simulation: Simulation, vehicle: Vehicle, request: _Request, one: Any) -> Map:
    stage = simulation.stage
    image = stage.image(request.kind, one, as_float=request.is_float)
    numbers: list[float] = []
    content = b""
    if request.is_float:
        numbers = image.flatten().tolist()
    elif request.is_compressed:
        content = png(image)
    else:
        content = _raw(image, request.channels)
    place, turn = _camera_in_world(simulation, vehicle, request.camera)
    legacy = request.channels == "rgba"
    response: Map = {
        "image_data_uint8": content,
        "image_data_float": numbers,
        "camera_position": messages.vector(place),
        "camera_orientation": messages.quaternion(turn),
        "time_stamp": messages.nanoseconds(simulation.time),
        "message": "",
        "pixels_as_float": request.is_float,
        "compress": request.is_compressed,
        "width": one["capture"].width,
        "height": one["capture"].height,
        "image_type": int(request.kind),
    }
    response["camera_id" if legacy else "camera_name"] = (
        request.given if legacy else text(str(request.given), "camera_name")
    )
    if request.channels == "rgb":
        response["annotation_name"] = ""
    return response


def _raw(image: torch.Tensor, channels: str) -> bytes:
    if channels == "bgr":
        image = image.flip(-1)
    elif channels == "rgba":
        image = torch.nn.functional.pad(image, (0, 1), value=255)
    return image.contiguous().numpy().tobytes()


@method("simGetImage", least=2)
def _image(simulation: Simulation, args: Sequence[Any]) -> bytes:
    camera, kind = _camera(args[0]), _image_type(args[1])
    vehicle = simulation.find(_name(args, 2), is_pose=True)
    state = simulation.cameras[vehicle.choice.name][camera]
    (one,) = simulation.stage.render(vehicle.body, camera, state, [kind])
    return png(simulation.stage.image(kind, one, as_float=False))


def _camera_in_world(
    simulation: Simulation, vehicle: Vehicle, camera: str
) -> tuple[list[float], list[float]]:
    """Return a camera's pose in NED relative to the start: metres, quaternion (w, x, y, z)."""
    state = simulation.cameras[vehicle.choice.name][camera]
    body = vehicle.body
    attitude = body.attitude[0].double()
    place = body.position[0] + rotate(attitude, attitude.new_tensor(state.position)) - vehicle.home
    turn = product(attitude, state.attitude)
    return messages.ned(place[None]), messages.ned_attitude(turn[None])


@method("simGetCameraInfo", least=1)
def _camera_info(simulation: Simulation, args: Sequence[Any]) -> Map:
    camera = _camera(args[0])
    vehicle = simulation.find(_name(args, 1), is_pose=True)
    place, turn = _camera_in_world(simulation, vehicle, camera)
    capture = simulation.cameras[vehicle.choice.name][camera].capture(ImageType.SCENE)
    return {
        "pose": {"position": messages.vector(place), "orientation": messages.quaternion(turn)},
        "fov": capture.fov,
        "proj_mat": {"matrix": _projection(capture.fov, capture.width / capture.height)},
    }


def _projection(fov: float, aspect: float, near: float = 0.1) -> list[list[float]]:
    """Return Unreal's reversed projection matrix for a horizontal field of view, degrees."""
    scale = 1.0 / math.tan(math.radians(fov) / 2)
    return [
        [scale, 0.0, 0.0, 0.0],
        [0.0, scale * aspect, 0.0, 0.0],
        [0.0, 0.0, 0.0, near],
        [0.0, 0.0, 1.0, 0.0],
    ]


@method("simSetCameraPose", least=2)
def _set_camera_pose(simulation: Simulation, args: Sequence[Any]) -> None:
    camera, pose = _camera(args[0]), read_pose(args[1])
    vehicle = simulation.find(_name(args, 2), is_pose=True)
    state = simulation.cameras[vehicle.choice.name][camera]
    given = to_world(pose.position)
    x, y, z = (
        old if math.isnan(new) else new for old, new in zip(state.position, given, strict=True)
    )
    if not any(map(math.isnan, pose.attitude)):
        state.attitude = messages.attitude_to_world(pose.attitude)[0]
    state.position = (x, y, z)


@method("simSetCameraOrientation", least=2)
def _set_camera_orientation(simulation: Simulation, args: Sequence[Any]) -> None:
    camera = _camera(args[0])
    keys = ("w_val", "x_val", "y_val", "z_val")
    attitude = messages.attitude_to_world(read_map(args[1], "orientation", keys))
    vehicle = simulation.find(_name(args, 2), is_pose=True)
    simulation.cameras[vehicle.choice.name][camera].attitude = attitude[0]


@method("simSetCameraFov", least=2)
def _set_camera_fov(simulation: Simulation, args: Sequence[Any]) -> None:
    camera, fov = _camera(args[0]), number(args[1], "fov_degrees", 1.0, 170.0)
    vehicle = simulation.find(_name(args, 2), is_pose=True)
    simulation.cameras[vehicle.choice.name][camera].fov = fov


# Scene


@method("simGetObjectPose", least=1)
def _object_pose(simulation: Simulation, args: Sequence[Any]) -> Map:
    return simulation.object_pose(text(args[0], "object_name"))


@method("simSetObjectPose", least=2)
def _set_object_pose(simulation: Simulation, args: Sequence[Any]) -> bool:
    name, pose = text(args[0], "object_name"), read_pose(args[1])
    if name in simulation.vehicles:
        simulation.vehicles[name].set_airsim_pose(pose, ignore_collision=True)
        return True
    return simulation.stage.move_object(name, to_world(pose.position))


@method("simGetObjectScale", least=1)
def _object_scale(simulation: Simulation, args: Sequence[Any]) -> Map:
    is_known = text(args[0], "object_name") in simulation.stage.names
    return messages.vector((1.0,) * 3 if is_known else NO_POSE.position)


@method("simListSceneObjects")
def _list_objects(simulation: Simulation, args: Sequence[Any]) -> list[str]:
    pattern = text(_at(args, 0, ".*"), "name_regex")
    vehicles = [n for n in simulation.vehicles if n and _matches(pattern, n)]
    return [*simulation.stage.find(pattern), *vehicles]


def _matches(pattern: str, name: str) -> bool:
    return re.fullmatch(pattern, name, re.IGNORECASE) is not None


@method("simListAssets")
def _list_assets(simulation: Simulation, args: Sequence[Any]) -> list[str]:
    return ["Cube", "Sphere", "Cylinder"]


@method("simSpawnObject", least=3)
def _spawn(simulation: Simulation, args: Sequence[Any]) -> str:
    name, asset, pose = text(args[0], "object_name"), text(args[1], "asset_name"), args[2]
    place = to_world(read_pose(pose).position)
    if any(map(math.isnan, place)):
        raise InputError("pose has NaN; give the position of a new object")
    scale = read_vector(_at(args, 3, messages.vector((1.0, 1.0, 1.0))), "scale")
    if len({*scale}) > 1 or not 0.0 < scale[0] <= 100.0:
        raise InputError(f"scale={list(scale)} is not supported; give one factor, 0 to 100")
    return simulation.stage.spawn(name or "object", asset, place, scale[0])


@method("simDestroyObject", least=1)
def _destroy(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.stage.destroy(text(args[0], "object_name"))


@method("simSetSegmentationObjectID", least=2)
def _set_id(simulation: Simulation, args: Sequence[Any]) -> bool:
    name, found = text(args[0], "mesh_name"), whole(args[1], "object_id", -1, 255)
    is_pattern = flag(_at(args, 2, False), "is_name_regex")
    return simulation.stage.set_id(name, found, is_pattern=is_pattern)


@method("simGetSegmentationObjectID", least=1)
def _get_id(simulation: Simulation, args: Sequence[Any]) -> int:
    return simulation.stage.get_id(text(args[0], "mesh_name"))


@method("simAddVehicle", least=3)
def _add_vehicle(simulation: Simulation, args: Sequence[Any]) -> bool:
    name, kind = text(args[0], "vehicle_name"), text(args[1], "vehicle_type")
    return simulation.add_named(name, kind, args[2])


@method("simSetWind", least=1)
def _set_wind(simulation: Simulation, args: Sequence[Any]) -> None:
    wind = to_world(read_vector(args[0], "wind"))
    if max(map(abs, wind)) > 50.0:
        raise InputError(f"wind={list(wind)} is out of range; give at most 50 m/s each way")
    simulation.set_wind(wind)


@method("simEnableWeather", least=1)
def _enable_weather(simulation: Simulation, args: Sequence[Any]) -> None:
    if not flag(args[0], "enable"):
        simulation.stage.clear_weather()


_FOG = 7


@method("simSetWeatherParameter", least=2)
def _weather(simulation: Simulation, args: Sequence[Any]) -> None:
    which, share = whole(args[0], "param", 0, 8), number(args[1], "val", 0.0, 1.0)
    if which == _FOG:
        simulation.stage.set_fog(share)
    elif share > 0.0:
        raise InputError(f"param={which} is not supported; of the weather only fog ({_FOG}) is")


@method("simSetTimeOfDay", least=1)
def _time_of_day(simulation: Simulation, args: Sequence[Any]) -> None:
    if not flag(args[0], "is_enabled"):
        simulation.stage.clear_weather()
        return
    hour = 12.0
    given = text(_at(args, 1, ""), "start_datetime")
    found = re.search(r"(\d{1,2}):(\d{2})", given)
    if given and not found:
        raise InputError(f"start_datetime={given!r} has no time; give YYYY-MM-DD HH:MM:SS")
    if found:
        hour = int(found[1]) + int(found[2]) / 60
    angle = (hour - 12.0) / 12.0 * 180.0
    elevation = math.degrees(math.asin(math.cos(math.radians(angle)) * 0.82))
    simulation.stage.set_sun(elevation, 90.0 - angle)


@method("startRecording")
def _start_recording(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.start_recording()


@method("stopRecording")
def _stop_recording(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.stop_recording()


@method("isRecording")
def _is_recording(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.recording is not None


def _accepted(simulation: Simulation, args: Sequence[Any]) -> None:
    """Do nothing: what the call changes is only seen in Unreal's window."""


_NOT_SHOWN = """
simPrintLogMessage simSetTraceLine simFlushPersistentMarkers simPlotPoints simPlotLineStrip
simPlotLineList simPlotArrows simPlotStrings simPlotTransforms simPlotTransformsWithNames
simToggleCameraWindow
"""
method(*_NOT_SHOWN.split())(_accepted)


@method("simRunConsoleCommand")
def _console(simulation: Simulation, args: Sequence[Any]) -> bool:
    return False


@method(
    "setAngleRateControllerGains",
    "setAngleLevelControllerGains",
    "setVelocityControllerGains",
    "setPositionControllerGains",
    least=3,
)
def _gains(simulation: Simulation, args: Sequence[Any]) -> None:
    """Accept the gains of AirSim's controller, which are fixed here."""
    for value, name in zip(args, ("kp", "ki", "kd"), strict=False):
        if not isinstance(value, list | tuple) or len(value) > 4:
            raise InputError(f"{name} is not a list of gains; give three or four numbers")
    _log.warning("controller gains are fixed here; the call has no effect")
