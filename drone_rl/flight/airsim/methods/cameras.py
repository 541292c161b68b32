"""Methods that report, or set, where cameras are and what they see."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.cameras import CameraState
from drone_rl.flight.airsim.messages import Map, number, read_map, read_pose, text, to_world
from drone_rl.flight.airsim.methods.registry import method, sim_vehicle_at
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.entities import find_camera
from drone_rl.sim.rendering.appearance import product

_NEAR = 10.0
"""Unreal's near plane, centimetres."""


def read_camera(value: Any) -> str:
    """Return our name of a camera."""
    return find_camera(value if isinstance(value, int) else text(value, "camera_name")).name


def camera_in_world(
    simulation: Simulation, vehicle: Vehicle, camera: str
) -> tuple[list[float], list[float]]:
    """Return a camera's pose in NED relative to the start: metres, quaternion (w, x, y, z)."""
    state = simulation.cameras[vehicle.choice.name][camera]
    turn = product(vehicle.body.attitude[0].double(), state.attitude)
    place = vehicle.place_of(state) - vehicle.home
    return messages.ned(place[None]), messages.ned_attitude(turn[None])


@method("getCameraInfo", least=1)
def _camera_pose(simulation: Simulation, args: Sequence[Any]) -> Map:
    camera = read_camera(args[0])
    vehicle = sim_vehicle_at(simulation, args, 1)
    place, turn = camera_in_world(simulation, vehicle, camera)
    capture = simulation.cameras[vehicle.choice.name][camera].capture(ImageType.SCENE)
    pose = {"position": messages.vector(place), "orientation": messages.quaternion(turn)}
    return {"pose": pose, "fov": capture.fov}


@method("simGetCameraInfo", least=1)
def _camera_info(simulation: Simulation, args: Sequence[Any]) -> Map:
    capture = camera_at(simulation, args, 1).capture(ImageType.SCENE)
    matrix = _projection(capture.fov, capture.width, capture.height)
    return {**_camera_pose(simulation, args), "proj_mat": {"matrix": matrix}}


def _projection(fov: float, width: int, height: int) -> list[list[float]]:
    """Return AirSim's matrix: of Unreal's reversed depth, times (north, east, down, 1).

    `fov`, degrees, is that of the longer side.
    """
    scale, longer = 1.0 / math.tan(math.radians(fov) / 2), max(width, height)
    return [
        [0.0, scale * longer / width, 0.0, 0.0],
        [0.0, 0.0, -scale * longer / height, 0.0],
        [0.0, 0.0, 0.0, _NEAR],
        [-1.0, 0.0, 0.0, 0.0],
    ]


@method("simSetCameraPose", least=2)
def _set_camera_pose(simulation: Simulation, args: Sequence[Any]) -> None:
    camera, pose = camera_at(simulation, args), read_pose(args[1])
    given = to_world(pose.position)
    x, y, z = (
        old if math.isnan(new) else new for old, new in zip(camera.position, given, strict=True)
    )
    attitude = camera.attitude
    if not any(map(math.isnan, pose.attitude)):
        attitude = messages.attitude_to_world(pose.attitude)[0]
    put_camera(simulation, args, dataclasses.replace(camera, position=(x, y, z), attitude=attitude))


@method("simSetCameraOrientation", "setCameraOrientation", least=2)
def _set_camera_orientation(simulation: Simulation, args: Sequence[Any]) -> None:
    keys = ("w_val", "x_val", "y_val", "z_val")
    attitude = messages.attitude_to_world(read_map(args[1], "orientation", keys))[0]
    camera = camera_at(simulation, args)
    put_camera(simulation, args, dataclasses.replace(camera, attitude=attitude))


@method("simSetCameraFov", least=2)
def _set_camera_fov(simulation: Simulation, args: Sequence[Any]) -> None:
    fov = number(args[1], "fov_degrees", 1.0, 170.0)
    put_camera(simulation, args, dataclasses.replace(camera_at(simulation, args), fov=fov))


def camera_at(simulation: Simulation, args: Sequence[Any], index: int = 2) -> CameraState:
    """Return the camera of the first argument, of the vehicle that another one names."""
    vehicle = sim_vehicle_at(simulation, args, index)
    return simulation.cameras[vehicle.choice.name][read_camera(args[0])]


def put_camera(
    simulation: Simulation, args: Sequence[Any], camera: CameraState, index: int = 2
) -> None:
    """Replace a camera of the vehicle that an argument names."""
    vehicle = sim_vehicle_at(simulation, args, index)
    simulation.cameras[vehicle.choice.name][camera.name] = camera
