"""Methods that render images, with the channel orders of AirSim 1.1, AirSim and Cosys-AirSim."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from torch import Tensor

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, flag, text, whole
from drone_rl.flight.airsim.methods.cameras import CAMERA, camera_in_world, read_camera
from drone_rl.flight.airsim.methods.registry import VEHICLE, given, method
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.stage import Shot, png
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.utils.errors import InputError

MAX_IMAGES = 64
"""Images in one call."""


@dataclasses.dataclass(frozen=True)
class _Request:
    camera: Any
    """The camera as the client called it."""
    kind: ImageType
    is_float: bool
    is_compressed: bool
    channels: str
    """Order of a raw image's channels: "rgba" in version 1.1, "bgr", or Cosys' "rgb"."""


def _read_request(value: Any) -> _Request:
    if not isinstance(value, dict):
        raise InputError(
            "an image request is not a map; give ImageRequest(camera, image_type, ...)"
        )
    sent = {k.decode() if isinstance(k, bytes) else k: v for k, v in value.items()}
    is_legacy = "camera_id" in sent
    camera = sent.get("camera_id" if is_legacy else "camera_name")
    return _Request(
        camera if isinstance(camera, int) else text(camera, "camera_name"),
        _read_type(sent.get("image_type"), "image_type"),
        flag(sent.get("pixels_as_float", False), "pixels_as_float"),
        flag(sent.get("compress", True), "compress"),
        "rgba" if is_legacy else "rgb" if "annotation_name" in sent else "bgr",
    )


def _read_requests(value: Any, name: str) -> list[_Request]:
    if not isinstance(value, list | tuple) or len(value) > MAX_IMAGES:
        raise InputError(f"{name} are not a list of at most {MAX_IMAGES}; give ImageRequests")
    return [_read_request(one) for one in value]


def _read_type(value: Any, name: str) -> ImageType:
    number = whole(value, name, 0, 10)
    if number >= len(ImageType):
        names = ", ".join(f"{kind.value} ({kind.name.lower()})" for kind in ImageType)
        raise InputError(f"{name}={number} is not supported; give one of: {names}")
    return ImageType(number)


@method("simGetImages", given(_read_requests, "requests"), VEHICLE)
def _images(simulation: Simulation, requests: Sequence[_Request], vehicle: Vehicle) -> list[Map]:
    cameras = [read_camera(request.camera) for request in requests]
    responses: dict[int, Map] = {}
    for camera in dict.fromkeys(cameras):
        rows = [i for i, one in enumerate(cameras) if one == camera]
        kinds = [requests[i].kind for i in rows]
        shots = simulation.stage.render(vehicle.body, vehicle.cameras[camera], kinds)
        place = messages.pose(camera_in_world(vehicle, camera))
        for i, shot in zip(rows, shots, strict=True):
            responses[i] = _response(simulation, requests[i], shot, place)
    return [responses[i] for i in range(len(requests))]


def _response(simulation: Simulation, request: _Request, shot: Shot, place: Map) -> Map:
    image = simulation.stage.image(request.kind, shot, as_float=request.is_float)
    numbers: list[float] = []
    content, channels = b"", request.channels
    if request.is_float:
        numbers = image.flatten().tolist()
    elif request.is_compressed:
        content = png(image)
    else:
        is_old = simulation.raw_channels == 4 and channels == "bgr"
        content = _raw(image, "rgba" if is_old else channels)
    response: Map = {
        "image_data_uint8": content,
        "image_data_float": numbers,
        "camera_position": place["position"],
        "camera_orientation": place["orientation"],
        "time_stamp": simulation.stamp,
        "message": "",
        "pixels_as_float": request.is_float,
        "compress": request.is_compressed,
        "width": shot.capture.width,
        "height": shot.capture.height,
        "image_type": int(request.kind),
    }
    if channels == "rgba":
        return {**response, "camera_id": request.camera}
    response["camera_name"] = str(request.camera)
    return {**response, "annotation_name": ""} if channels == "rgb" else response


def _raw(image: Tensor, channels: str) -> bytes:
    pixels = image.numpy()
    if channels == "bgr":
        pixels = pixels[..., ::-1]
    elif channels == "rgba":
        pixels = np.concatenate([pixels, np.full_like(pixels[..., :1], 255)], -1)
    return pixels.tobytes()


@method("simGetImage", CAMERA, given(_read_type, "image_type"), VEHICLE)
def _image(simulation: Simulation, camera: str, kind: ImageType, vehicle: Vehicle) -> bytes:
    (shot,) = simulation.stage.render(vehicle.body, vehicle.cameras[camera], [kind])
    return png(simulation.stage.image(kind, shot, as_float=False))
