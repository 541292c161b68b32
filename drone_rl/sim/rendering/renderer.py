"""The renderer interface, and the choice of a renderer by name.

`raytrace` (the default) is this project's ray tracer: of simple solids on CPU and GPU, of any
scene on a CPU. `mujoco_warp` renders any MuJoCo model, several times slower.
"""

import dataclasses
import importlib
from typing import Protocol

from torch import Tensor

from drone_rl.config.camera import RENDERERS
from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import Modality, View
from drone_rl.utils.batch import Batch
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown


@dataclasses.dataclass
class Poses(Batch):
    """Poses of drones, quaternions (w, x, y, z), and positions of the task's props. Metres."""

    position: Tensor  # (num_envs, 3)
    attitude: Tensor  # (num_envs, 4)
    props: Tensor  # (num_envs, num_props, 3)


class Renderer(Protocol):
    """Renders a batch of environments that share one scene; it holds no simulation state."""

    def prepare(self, view: View) -> None:
        """Prepare a view; raise an `InputError` if the renderer does not support it."""

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Render any number of environments, in the model's own appearance by default.

        Returns:
            Images by modality. Shapes: (num_envs, num_cameras, H, W, *). "rgb": uint8, 3 a pixel;
            "gray": float32, equal to what the transform `GrayPixels` makes of RGB; "depth",
            "distance": float32, metres along the camera's axis or along the pixel's ray, 0 where
            nothing is hit; "segmentation": int32, geom index, -1 where nothing is hit; "normals":
            float32, 3 a pixel, unit normal of the surface, world frame, 0 where nothing is hit.

        Raises:
            InputError: The renderer does not support the view or the appearance.
        """
        ...

    def close(self) -> None:
        """Stop the worker threads."""


class RendererFactory(Protocol):
    """Makes a renderer of a scene."""

    def __call__(
        self, scene: Scene, *, num_envs: int, num_shards: int | None, device: str
    ) -> Renderer:
        """Make the renderer.

        About `num_envs` environments are rendered per call, on the device "cpu", "cuda" or
        "cuda:N". `num_shards` worker threads split the batch; their number is the renderer's choice
        if None.
        """
        ...


_CLASSES = {
    "raytrace": "drone_rl.sim.rendering.raytrace.world_renderer.make_raytracer",
    "mujoco_warp": "drone_rl.sim.rendering.mujoco_warp.WarpRenderer",
}
"""What makes each renderer, imported when it is needed."""


def find_renderer(which: str | RendererFactory) -> RendererFactory:
    """Return the factory of a name in `RENDERERS`; a factory is returned as it is."""
    if not isinstance(which, str):
        if not callable(which):
            raise InputError(
                f"renderer={shown(which)} is no renderer; give one of: {', '.join(RENDERERS)}"
            )
        return which
    if which not in RENDERERS:
        raise InputError(f"renderer={which!r} is unknown; give one of: {', '.join(RENDERERS)}")
    module, _, name = _CLASSES[which].rpartition(".")
    return getattr(importlib.import_module(module), name)
