"""Methods that report, or set, where cameras are and what they see."""

import dataclasses
import math
from typing import Any

import torch

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import (
    Map,
    Pose,
    attitude_to_world,
    number,
    read_attitude,
    read_pose,
    text,
    to_world,
)
from drone_rl.flight.airsim.methods.registry import given, vehicle_method
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.entities import find_camera
from drone_rl.sim.rendering.appearance import product

_NEAR = 10.0
"""Unreal's near plane, centimetres."""


def read_camera(value: Any, name: str = "camera_name") -> str:
    """Return our name of a camera."""
    return find_camera(value if isinstance(value, int) else text(value, name)).name


CAMERA = given(read_camera, "camera_name")


def camera_in_world(vehicle: Vehicle, camera: str) -> Pose:
    """Return a camera's pose in NED relative to the start."""
    state = vehicle.cameras[camera]
    turn = product(vehicle.body.attitude[0].double(), state.attitude)
    return Pose.of(vehicle.place_of(state) - vehicle.home, turn)


@vehicle_method("getCameraInfo", CAMERA)
def _camera_pose(vehicle: Vehicle, camera: str) -> Map:
    fov = vehicle.cameras[camera].capture(ImageType.SCENE).fov
    return {"pose": messages.pose(camera_in_world(vehicle, camera)), "fov": fov}


@vehicle_method("simGetCameraInfo", CAMERA)
def _camera_info(vehicle: Vehicle, camera: str) -> Map:
    capture = vehicle.cameras[camera].capture(ImageType.SCENE)
    matrix = _projection(capture.fov, capture.width, capture.height)
    return {**_camera_pose(vehicle, camera), "proj_mat": {"matrix": matrix}}


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


def change_camera(vehicle: Vehicle, camera: str, changes: Map) -> None:
    """Change fields of the state of a vehicle's camera."""
    vehicle.cameras[camera] = dataclasses.replace(vehicle.cameras[camera], **changes)


@vehicle_method("simSetCameraPose", CAMERA, given(read_pose, "pose"))
def _set_camera_pose(vehicle: Vehicle, camera: str, pose: Pose) -> None:
    state = vehicle.cameras[camera]
    whole = pose.merged(Pose.of(torch.tensor(state.position, dtype=torch.float64), state.attitude))
    attitude = attitude_to_world(whole.attitude)
    place = to_world(whole.position)
    change_camera(vehicle, camera, {"position": place, "attitude": attitude})


@vehicle_method(
    "simSetCameraOrientation setCameraOrientation", CAMERA, given(read_attitude, "orientation")
)
def _set_camera_orientation(vehicle: Vehicle, camera: str, attitude: list[float]) -> None:
    change_camera(vehicle, camera, {"attitude": attitude_to_world(attitude)})


@vehicle_method("simSetCameraFov", CAMERA, given(number, "fov_degrees", 1.0, 170.0))
def _set_camera_fov(vehicle: Vehicle, camera: str, fov: float) -> None:
    change_camera(vehicle, camera, {"fov": fov})
