"""Methods that render images, with the channel orders of AirSim 1.1, AirSim and Cosys-AirSim."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from torch import Tensor

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, flag, text, whole
from drone_rl.flight.airsim.methods.cameras import camera_in_world, read_camera
from drone_rl.flight.airsim.methods.registry import method, sim_vehicle_at
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.stage import Shot, Stage, png
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.utils.errors import InputError

MAX_IMAGES = 64
"""Images in one call."""
_INFRARED = 7


@dataclasses.dataclass(frozen=True)
class _Request:
    camera: str
    given: Any
    """The camera as the client called it."""
    kind: ImageType
    is_infrared: bool
    """Whether segmentation ids are shown in gray."""
    is_float: bool
    is_compressed: bool
    channels: str
    """Order of a raw image's channels: "rgba" in version 1.1, "bgr", or Cosys' "rgb"."""


def _read_request(value: Any) -> _Request:
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
        read_camera(camera),
        camera if isinstance(camera, int) else text(camera, "camera_name"),
        *_image_type(given["image_type"]),
        flag(given.get("pixels_as_float", False), "pixels_as_float"),
        flag(given.get("compress", True), "compress"),
        order,
    )


def _image_type(value: Any) -> tuple[ImageType, bool]:
    """Return the type to render, and whether infrared is made from it."""
    found = whole(value, "image_type", 0, 10)
    if found == _INFRARED:
        return ImageType.SEGMENTATION, True
    if found > ImageType.SURFACE_NORMALS:
        names = ", ".join(f"{kind.value} ({kind.name.lower()})" for kind in ImageType)
        names = f"{names}, {_INFRARED} (infrared)"
        raise InputError(f"image_type={found} is not supported; give one of: {names}")
    return ImageType(found), False


def _pixels(stage: Stage, shot: Shot, kind: ImageType, is_infrared: bool, as_float: bool) -> Tensor:
    if is_infrared:
        return stage.infrared(shot, as_float=as_float)
    return stage.image(kind, shot, as_float=as_float)


@method("simGetImages", least=1)
def _images(simulation: Simulation, args: Sequence[Any]) -> list[Map]:
    if not isinstance(args[0], list | tuple) or len(args[0]) > MAX_IMAGES:
        raise InputError(f"requests are not a list of at most {MAX_IMAGES}; give ImageRequests")
    requests = [_read_request(value) for value in args[0]]
    vehicle = sim_vehicle_at(simulation, args, 1)
    cameras = simulation.cameras[vehicle.choice.name]
    found: list[Any] = [None] * len(requests)
    for camera in dict.fromkeys(request.camera for request in requests):
        rows = [i for i, request in enumerate(requests) if request.camera == camera]
        kinds = [requests[i].kind for i in rows]
        rendered = simulation.stage.render(vehicle.body, cameras[camera], kinds)
        for i, one in zip(rows, rendered, strict=True):
            found[i] = _response(simulation, vehicle, requests[i], one)
    return found


def _response(simulation: Simulation, vehicle: Vehicle, request: _Request, shot: Shot) -> Map:
    image = _pixels(simulation.stage, shot, request.kind, request.is_infrared, request.is_float)
    numbers: list[float] = []
    content = b""
    if request.is_float:
        numbers = image.flatten().tolist()
    elif request.is_compressed:
        content = png(image)
    else:
        is_old = simulation.raw_channels == 4 and request.channels == "bgr"
        content = _raw(image, "rgba" if is_old else request.channels)
    place, turn = camera_in_world(simulation, vehicle, request.camera)
    legacy = request.channels == "rgba"
    response: Map = {
        "image_data_uint8": content,
        "image_data_float": numbers,
        "camera_position": messages.vector(place),
        "camera_orientation": messages.quaternion(turn),
        "time_stamp": simulation.stamp,
        "message": "",
        "pixels_as_float": request.is_float,
        "compress": request.is_compressed,
        "width": shot.capture.width,
        "height": shot.capture.height,
        "image_type": _INFRARED if request.is_infrared else int(request.kind),
    }
    response["camera_id" if legacy else "camera_name"] = (
        request.given if legacy else str(request.given)
    )
    if request.channels == "rgb":
        response["annotation_name"] = ""
    return response


def _raw(image: Tensor, channels: str) -> bytes:
    pixels = image.numpy()
    if channels == "bgr":
        pixels = pixels[..., ::-1]
    elif channels == "rgba":
        pixels = np.concatenate([pixels, np.full_like(pixels[..., :1], 255)], -1)
    return pixels.tobytes()


@method("simGetImage", least=2)
def _image(simulation: Simulation, args: Sequence[Any]) -> bytes:
    camera, (kind, is_infrared) = read_camera(args[0]), _image_type(args[1])
    vehicle = sim_vehicle_at(simulation, args, 2)
    state = simulation.cameras[vehicle.choice.name][camera]
    (one,) = simulation.stage.render(vehicle.body, state, [kind])
    return png(_pixels(simulation.stage, one, kind, is_infrared, as_float=False))
