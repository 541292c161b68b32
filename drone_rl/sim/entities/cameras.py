# pyright: reportReturnType=false
# (dm_control's models of XML are untyped.)
"""The drone's five cameras, by AirSim's names, and the chase camera that films it."""

from typing import NamedTuple

from dm_control import mjcf

from drone_rl.config.camera import FRONT
from drone_rl.utils.errors import InputError


class CameraSpec(NamedTuple):
    """Where a camera sits on the drone. Metres, drone frame: x forward, y left, z up."""

    name: str
    pos: tuple[float, float, float]
    xyaxes: tuple[float, float, float, float, float, float]
    """The image's right and up axes; the camera looks along their negative cross product."""


_FORWARD = (0, -1, 0, 0, 0, 1)
FRONT_CENTER = CameraSpec("front_center", FRONT, _FORWARD)
FRONT_RIGHT = CameraSpec("front_right", (0.4, -0.25, 0), _FORWARD)
FRONT_LEFT = CameraSpec("front_left", (0.4, 0.25, 0), _FORWARD)
BOTTOM_CENTER = CameraSpec("bottom_center", (0, 0, -0.1), (0, -1, 0, 1, 0, 0))
BACK_CENTER = CameraSpec("back_center", (-0.4, 0, 0), (0, 1, 0, 0, 0, 1))
DRONE_CAMERAS = (FRONT_CENTER, FRONT_RIGHT, FRONT_LEFT, BOTTOM_CENTER, BACK_CENTER)
"""In the order of AirSim's camera numbers 0 to 4."""

CHASE = CameraSpec("chase", (-7.0, 0, 3.5), (0, -1, 0, 0.34, 0, 0.94))


def find_camera(name: str | int) -> CameraSpec:
    """A camera by AirSim's name or number.

    Args:
        name: Such as "back_center", "4" or 4; "" and "fpv" are the one in front.

    Raises:
        InputError: There is none.
    """
    if name in ("", "fpv"):
        return FRONT_CENTER
    for number, spec in enumerate(DRONE_CAMERAS):
        if str(name) in (spec.name, str(number)):
            return spec
    names = ", ".join(f"{spec.name} ({i})" for i, spec in enumerate(DRONE_CAMERAS))
    raise InputError(f"camera {name!r} is unknown; choose from: {names}")


def add_camera(body: mjcf.Element, spec: CameraSpec, vertical_fov: float) -> mjcf.Element:
    """Adds a camera to a body.

    Args:
        body: The MJCF body that carries it.
        spec: Its name and place.
        vertical_fov: Vertical field of view in degrees.
    """
    return body.add("camera", **spec._asdict(), fovy=vertical_fov)
