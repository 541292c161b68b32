"""Cameras of a vehicle: where they are mounted, and the sizes of their images."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.flight.airsim.messages import known, to_world
from drone_rl.flight.airsim.settings_file import CameraChoice, Capture, Offset
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.coordinates import attitude_of, inverse
from drone_rl.sim.entities import DRONE_CAMERAS, find_camera
from drone_rl.sim.rendering import Mounting
from drone_rl.sim.rendering.appearance import product, zoom_for_fov

_BASES = {"back_center": (0.0, 0.0, 180.0), "bottom_center": (0.0, -90.0, 0.0)}
"""AirSim's roll, pitch and yaw of cameras that do not look ahead, degrees."""
_LEVEL = (1.0, 0.0, 0.0, 0.0)
_DEFAULT = Capture()


@dataclasses.dataclass(frozen=True)
class CameraState:
    """A camera of a vehicle: where it is, and its images by type."""

    name: str
    """One of the names of `DRONE_CAMERAS`."""
    captures: Mapping[ImageType, Capture]
    position: tuple[float, float, float]
    """Metres, drone frame: x forward, y left, z up."""
    attitude: Tensor
    """Drone frame, quaternion (w, x, y, z). Shape: (4,)."""
    fov: float | None = None
    """Horizontal, degrees, of all types; None for those of `captures`."""
    detected: tuple[str, ...] = ()
    """Patterns of the names of objects that `simGetDetections` reports."""
    detection_radius: float = 200.0
    """Metres from the camera within which objects are reported."""

    def capture(self, kind: ImageType) -> Capture:
        """Return the size and field of view of images of a type."""
        capture = self.captures.get(kind, _DEFAULT)
        return capture if self.fov is None else capture._replace(fov=self.fov)

    def mounting(self, capture: Capture, vertical_fov: float) -> Mounting | None:
        """Return how it differs from the model's camera; None if it does not.

        `vertical_fov` is that of the model's camera, degrees.
        """
        model_fov = math.degrees(
            2 * math.atan(math.tan(math.radians(vertical_fov) / 2) * capture.width / capture.height)
        )
        base = _attitude(self.name, Offset())
        zoom = zoom_for_fov(model_fov, torch.tensor(capture.fov, dtype=torch.float64))
        spec = find_camera(self.name)
        offset = tuple(a - b for a, b in zip(self.position, spec.pos, strict=True))
        turn = product(self.attitude, inverse(base))
        is_zoomed = abs(float(zoom) - 1) > 1e-9
        is_turned = not torch.allclose(turn.abs(), turn.new_tensor(_LEVEL))
        if not (any(offset) or is_turned or is_zoomed):
            return None
        return Mounting(
            camera=f"drone/{self.name}",
            offset=offset,
            turn=tuple(turn.tolist()),
            zoom=zoom if is_zoomed else None,
        )


def make_cameras(
    captures: Mapping[ImageType, Capture], chosen: Mapping[str, CameraChoice]
) -> dict[str, CameraState]:
    """Return the cameras of a vehicle, by their names in `DRONE_CAMERAS`.

    Args:
        captures: Sizes and fields of view of all cameras, by type.
        chosen: What the settings say about single cameras, by name.
    """
    return {
        spec.name: _camera(spec, captures, chosen.get(spec.name, CameraChoice()))
        for spec in DRONE_CAMERAS
    }


def _camera(spec: Any, captures: Mapping[ImageType, Capture], choice: CameraChoice) -> CameraState:
    x, y, z = known(to_world(choice.position), spec.pos)
    attitude = _attitude(spec.name, choice)
    return CameraState(spec.name, {**captures, **choice.captures}, (x, y, z), attitude)


def _attitude(name: str, offset: Offset) -> Tensor:
    """Return a camera's attitude in the drone's frame, at AirSim's angles where given. (4,)."""
    return attitude_of(*known(offset.angles, _BASES.get(name, (0.0, 0.0, 0.0))))
