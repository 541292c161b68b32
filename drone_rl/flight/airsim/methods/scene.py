"""Methods of objects, added vehicles, wind, weather and light."""

import math
import re
from typing import Any

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.messages import (
    MAX_NAME,
    MAX_PATTERN,
    NO_POSE,
    Map,
    Pose,
    flag,
    number,
    read_pose,
    read_vector,
    text,
    to_world,
    whole,
)
from drone_rl.flight.airsim.methods.registry import given, method
from drone_rl.flight.airsim.patterns import matching
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.errors import InputError


def _read_scale(value: Any, name: str) -> float:
    x, y, z = (max(abs(part), 0.001) for part in read_vector(value, name, most=100.0))
    if not x == y == z:
        remark("the mean scale is used for all axes")
    return x if x == y == z else (x * y * z) ** (1 / 3)


_OBJECT, _MESH = given(text, "object_name"), given(text, "mesh_name", MAX_PATTERN)
_POSE = given(read_pose, "pose")

method("simGetObjectPose", _OBJECT)(Simulation.object_pose)
method("simListAssets")(
    lambda simulation: ["1M_Cube", "1M_Cube_Chamfer", "Cube", "Sphere", "Cylinder"]
)
method("simDestroyObject", _OBJECT)(lambda simulation, name: simulation.stage.destroy(name))
method("simSetObjectScale", _OBJECT, given(_read_scale, "scale"))(
    lambda simulation, name, size: simulation.stage.set_scale(name, size)
)
method("simGetSegmentationObjectID", _MESH)(lambda simulation, name: simulation.stage.get_id(name))
method("simAddVehicle", given(text, "vehicle_name", MAX_NAME), given(text, "vehicle_type"), _POSE)(
    Simulation.add_named
)
method("simEnableWeather", given(flag, "enable"))(
    lambda simulation, enable: simulation.stage.enable_weather(enable)
)


@method("simSetObjectPose", _OBJECT, _POSE, given(flag, "teleport", default=True))
def _set_object_pose(simulation: Simulation, name: str, pose: Pose, teleport: bool) -> bool:
    if name in simulation.vehicles:
        simulation.move_vehicle(name, pose, ignore_collision=teleport)
        return True
    return simulation.stage.move_object(name, simulation.place(pose.position))


@method("simGetObjectScale", _OBJECT)
def _object_scale(simulation: Simulation, name: str) -> Map:
    size = simulation.stage.scale(name)
    return messages.vector(NO_POSE.position if size is None else (size,) * 3)


@method("simListSceneObjects", given(text, "name_regex", MAX_PATTERN, default=".*"))
def _list_objects(simulation: Simulation, pattern: str) -> list[str]:
    return matching(pattern, [*simulation.stage.names, *filter(None, simulation.vehicles)])


@method(
    "simSpawnObject",
    given(text, "object_name", MAX_NAME),
    given(text, "asset_name"),
    _POSE,
    given(_read_scale, "scale", default=messages.vector((1.0, 1.0, 1.0))),
)
def _spawn(simulation: Simulation, name: str, asset: str, pose: Pose, size: float) -> str:
    place = simulation.place(pose.position)
    if any(map(math.isnan, place)):
        raise InputError("pose has NaN; give the position of a new object")
    if name in simulation.vehicles:
        raise InputError(f"object_name={name!r} is a vehicle's; give another name")
    return simulation.stage.spawn(name or "object", asset, place, size)


@method(
    "simSetSegmentationObjectID",
    _MESH,
    given(number, "object_id", -1, 255),
    given(flag, "is_name_regex", default=False),
)
def _set_id(simulation: Simulation, name: str, object_id: float, is_pattern: bool) -> bool:
    return simulation.stage.set_id(name, int(object_id), is_pattern=is_pattern)


@method("simSetWind", given(read_vector, "wind", 50.0))
def _set_wind(simulation: Simulation, wind: list[float]) -> None:
    simulation.set_wind(to_world(wind))


_FOG = 7


@method("simSetWeatherParameter", given(whole, "param", 0, 8), given(number, "val", 0.0, 1.0))
def _weather(simulation: Simulation, which: int, share: float) -> None:
    if which == _FOG:
        simulation.stage.set_fog(share)
    elif share > 0.0:
        remark("of the weather only fog is shown")


@method(
    "simSetTimeOfDay", given(flag, "is_enabled"), given(text, "start_datetime", default="12:00")
)
def _time_of_day(simulation: Simulation, is_enabled: bool, moment: str) -> None:
    if not is_enabled:
        simulation.stage.clear_sun()
        return
    match = re.search(r"\b(\d|[01]\d|2[0-3]):([0-5]\d)", moment or "12:00")
    if not match:
        raise InputError(f"start_datetime={moment!r} has no time; give YYYY-MM-DD HH:MM:SS")
    hour = int(match[1]) + int(match[2]) / 60
    angle = (hour - 12.0) / 12.0 * 180.0
    elevation = math.degrees(math.asin(math.cos(math.radians(angle)) * 0.82))
    simulation.stage.set_sun(elevation, 180.0 - angle)  # at noon in the south, behind
