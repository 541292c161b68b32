"""Settings of the policy's camera and the names of renderers."""

import math
from typing import Annotated

from drone_rl.config.values import Pixels
from drone_rl.utils.schema import OneOf, Real
from drone_rl.utils.settings import Settings

FRONT = (0.4, 0.0, 0.0)
"""Position of the policy's camera on the drone. Metres, drone frame: x forward, y left, z up."""


class CameraSettings(Settings):
    """Settings of the policy's camera."""

    width: Pixels = 64
    """Width of the image in pixels."""
    height: Pixels = 25
    """Height of the image in pixels."""
    horizontal_fov: Annotated[float, Real(4.0, 170.0, unit="degrees")] = 135.0
    """Horizontal field of view in degrees."""

    @property
    def vertical_fov(self) -> float:
        """Vertical field of view in degrees, for square pixels."""
        half = math.tan(math.radians(self.horizontal_fov) / 2) * self.height / self.width
        return math.degrees(2 * math.atan(half))


RENDERERS = ("raytrace", "mujoco_warp")
"""Names of the renderers, see `drone_rl.sim.rendering.renderer`."""

RendererName = Annotated[str, OneOf(RENDERERS)]
"""Type of a setting that selects a renderer."""


class RendererSettings(Settings):
    """Settings of a command that renders images."""

    renderer: RendererName = "raytrace"
    """Renderer: raytrace, this package's ray tracer, or mujoco_warp, MuJoCo Warp's."""


class DeviceSettings(RendererSettings):
    """Settings of a command that renders images and evaluates policies."""

    device: str = "cpu"
    """Device of renderer and policy: cpu, cuda or cuda:N."""
