"""A connected client, and what the versions of AirSim's clients spell differently."""

import importlib
import importlib.util
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

NANOSECONDS = 1e9


class Session:
    """One client of one version."""

    def __init__(self, module: str, port: int) -> None:
        """Connect to a server of this machine."""
        if importlib.util.find_spec("airsim_fixes") and module != "AirSimClient":
            importlib.import_module("airsim_fixes")
        self.airsim: Any = importlib.import_module(module)
        self.is_first = module == "AirSimClient"
        """Whether it is version 1.1: movements wait, nothing has a vehicle's name."""
        if self.is_first:  # it connects to port 41451 only
            base, self.client = self.airsim.AirSimClientBase, self.airsim.MultirotorClient
            self.client: Any = self.client.__new__(self.client)
            base.__init__(self.client, "127.0.0.1", port)
        else:
            self.client = self.airsim.MultirotorClient(port=port)

    def take_off(self, vehicle: str = "") -> None:
        """Do what AirSim's programs begin with."""
        who = () if self.is_first else (vehicle,)
        self.client.enableApiControl(True, *who)
        self.client.armDisarm(True, *who)
        self.client.takeoff() if self.is_first else self.client.takeoffAsync(20, *who).join()

    def fly(self, name: str, *args: Any) -> Any:
        """Make a movement, wait for its end, and return its result."""
        if self.is_first:
            return getattr(self.client, name)(*args)
        future = getattr(self.client, f"{name}Async")(*args)
        future.join()
        return future.get()

    def seconds(self) -> float:
        """Return the simulated time."""
        if self.is_first:
            return self.client.timestampNow() / NANOSECONDS
        return self.client.getMultirotorState().timestamp / NANOSECONDS

    # Poses

    def vector(self, x: float, y: float, z: float) -> Any:
        """Return a Vector3r."""
        return self.airsim.Vector3r(float(x), float(y), float(z))

    def pose(self, x: float, y: float, z: float, yaw: float = 0.0, pitch: float = 0.0) -> Any:
        """Return a Pose; angles are in degrees, to the right and up."""
        names = ("to_quaternion", "euler_to_quaternion")
        convert: Any = next((getattr(self.airsim, n) for n in names if hasattr(self.airsim, n)), 0)
        angles = math.radians(pitch), 0.0, math.radians(yaw)
        if self.is_first:
            convert = self.client.toQuaternion
        elif not hasattr(self.airsim, "to_quaternion"):  # Cosys' order
            angles = angles[1], angles[0], angles[2]
        return self.airsim.Pose(self.vector(x, y, z), convert(*angles))

    def put(self, pose: Any, ignore_collision: bool = True) -> None:
        """Teleport the vehicle."""
        name = "simSetPose" if self.is_first else "simSetVehiclePose"
        getattr(self.client, name)(pose, ignore_collision)

    def place(self, vehicle: str = "") -> list[float]:
        """Return the vehicle's position."""
        if self.is_first:
            return components(self.client.simGetPose()[b"position"])
        return components(self.client.simGetVehiclePose(vehicle).position)

    def angles(self) -> list[float]:
        """Return the vehicle's pitch and yaw, degrees: up and to the right."""
        if self.is_first:
            found = self.client.simGetPose()[b"orientation"]
            w, x, y, z = (found[key] for key in (b"w_val", b"x_val", b"y_val", b"z_val"))
        else:
            found = self.client.simGetVehiclePose().orientation
            w, x, y, z = found.w_val, found.x_val, found.y_val, found.z_val
        pitch = math.asin(2.0 * (w * y - z * x))
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return [math.degrees(pitch), math.degrees(yaw)]

    def collision(self, vehicle: str = "") -> Any:
        """Return the CollisionInfo."""
        if self.is_first:
            return self.client.getCollisionInfo()
        return self.client.simGetCollisionInfo(vehicle)

    def vehicle(self) -> str:
        """Return the name of the first vehicle among the objects."""
        return (
            self.client.listVehicles()[0]
            if hasattr(self.client, "listVehicles")
            else "SimpleFlight"
        )

    # Images

    def images(self, *requests: Sequence[Any]) -> Any:
        """Return responses to requests of camera, type, whether as numbers, whether as PNG."""
        return self.client.simGetImages([self.airsim.ImageRequest(*one) for one in requests])

    def depths(self, kind: int = 1, camera: int = 0) -> Any:
        """Return an image of numbers. Shape: (H, W)."""
        (one,) = self.images((camera, kind, True, False))
        return np.array(one.image_data_float).reshape(one.height, one.width)

    def colors(self, kind: int = 0, camera: int = 0) -> Any:
        """Return a raw image. Shape: (H, W, C), uint8."""
        (one,) = self.images((camera, kind, False, False))
        return np.frombuffer(one.image_data_uint8, np.uint8).reshape(one.height, one.width, -1)


def components(vector: Any) -> list[float]:
    """Return the components of a Vector3r, which version 1.1 returns as a dict in structures."""
    if isinstance(vector, dict):
        return [vector[key] for key in (b"x_val", b"y_val", b"z_val")]
    return [vector.x_val, vector.y_val, vector.z_val]
