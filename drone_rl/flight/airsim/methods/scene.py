"""Methods of objects, added vehicles, wind, weather and light."""

import math
import re
from collections.abc import Sequence
from typing import Any

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.messages import (
    MAX_NAME,
    MAX_PATTERN,
    NO_POSE,
    Map,
    flag,
    number,
    read_pose,
    read_vector,
    text,
    to_world,
    whole,
)
from drone_rl.flight.airsim.methods.registry import argument, method
from drone_rl.flight.airsim.patterns import matching
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.errors import InputError


@method("simGetObjectPose", least=1)
def _object_pose(simulation: Simulation, args: Sequence[Any]) -> Map:
    return simulation.object_pose(text(args[0], "object_name"))


@method("simSetObjectPose", least=2)
def _set_object_pose(simulation: Simulation, args: Sequence[Any]) -> bool:
    name, pose = text(args[0], "object_name"), read_pose(args[1])
    if name in simulation.vehicles:
        is_teleport = flag(argument(args, 2, True), "teleport")
        simulation.move_vehicle(name, pose, ignore_collision=is_teleport)
        return True
    return simulation.stage.move_object(name, simulation.place(pose.position))


@method("simGetObjectScale", least=1)
def _object_scale(simulation: Simulation, args: Sequence[Any]) -> Map:
    size = simulation.stage.scale(text(args[0], "object_name"))
    return messages.vector(NO_POSE.position if size is None else (size,) * 3)


@method("simSetObjectScale", least=2)
def _set_object_scale(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.stage.set_scale(text(args[0], "object_name"), _read_scale(args[1]))


def _read_scale(value: Any) -> float:
    x, y, z = (max(abs(part), 0.001) for part in read_vector(value, "scale", most=100.0))
    if not x == y == z:
        remark("the mean scale is used for all axes")
    return x if x == y == z else (x * y * z) ** (1 / 3)


@method("simListSceneObjects")
def _list_objects(simulation: Simulation, args: Sequence[Any]) -> list[str]:
    pattern = text(argument(args, 0, ".*"), "name_regex", MAX_PATTERN)
    return matching(pattern, [*simulation.stage.names, *filter(None, simulation.vehicles)])


@method("simListAssets")
def _list_assets(simulation: Simulation, args: Sequence[Any]) -> list[str]:
    return ["1M_Cube", "1M_Cube_Chamfer", "Cube", "Sphere", "Cylinder"]


@method("simSpawnObject", least=3)
def _spawn(simulation: Simulation, args: Sequence[Any]) -> str:
    name, asset = text(args[0], "object_name", MAX_NAME), text(args[1], "asset_name")
    pose = args[2]
    place = simulation.place(read_pose(pose).position)
    if any(map(math.isnan, place)):
        raise InputError("pose has NaN; give the position of a new object")
    if name in simulation.vehicles:
        raise InputError(f"object_name={name!r} is a vehicle's; give another name")
    size = _read_scale(argument(args, 3, messages.vector((1.0, 1.0, 1.0))))
    return simulation.stage.spawn(name or "object", asset, place, size)


@method("simDestroyObject", least=1)
def _destroy(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.stage.destroy(text(args[0], "object_name"))


@method("simSetSegmentationObjectID", least=2)
def _set_id(simulation: Simulation, args: Sequence[Any]) -> bool:
    name, found = text(args[0], "mesh_name", MAX_PATTERN), number(args[1], "object_id", -1, 255)
    is_pattern = flag(argument(args, 2, False), "is_name_regex")
    return simulation.stage.set_id(name, int(found), is_pattern=is_pattern)


@method("simGetSegmentationObjectID", least=1)
def _get_id(simulation: Simulation, args: Sequence[Any]) -> int:
    return simulation.stage.get_id(text(args[0], "mesh_name"))


@method("simAddVehicle", least=3)
def _add_vehicle(simulation: Simulation, args: Sequence[Any]) -> bool:
    name, kind = text(args[0], "vehicle_name", MAX_NAME), text(args[1], "vehicle_type")
    return simulation.add_named(name, kind, args[2])


@method("simSetWind", least=1)
def _set_wind(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.set_wind(to_world(read_vector(args[0], "wind", most=50.0)))


@method("simEnableWeather", least=1)
def _enable_weather(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.stage.enable_weather(flag(args[0], "enable"))


_FOG = 7


@method("simSetWeatherParameter", least=2)
def _weather(simulation: Simulation, args: Sequence[Any]) -> None:
    which, share = whole(args[0], "param", 0, 8), number(args[1], "val", 0.0, 1.0)
    if which == _FOG:
        simulation.stage.set_fog(share)
    elif share > 0.0:
        remark("of the weather only fog is shown")


@method("simSetTimeOfDay", least=1)
def _time_of_day(simulation: Simulation, args: Sequence[Any]) -> None:
    if not flag(args[0], "is_enabled"):
        simulation.stage.clear_sun()
        return
    hour = 12.0
    given = text(argument(args, 1, ""), "start_datetime")
    found = re.search(r"\b(\d|[01]\d|2[0-3]):([0-5]\d)", given)
    if given and not found:
        raise InputError(f"start_datetime={given!r} has no time; give YYYY-MM-DD HH:MM:SS")
    if found:
        hour = int(found[1]) + int(found[2]) / 60
    angle = (hour - 12.0) / 12.0 * 180.0
    elevation = math.degrees(math.asin(math.cos(math.radians(angle)) * 0.82))
    simulation.stage.set_sun(elevation, 180.0 - angle)  # at noon in the south, behind
