"""What a renderer must offer: pictures of worlds that it does not hold."""

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


@dataclasses.dataclass
class Poses(Batch):
    """Where everything that moves is. Metres, world frame."""

    position: Tensor  # (num_worlds, 3)
    """Of the drone."""
    attitude: Tensor  # (num_worlds, 4)
    """Of the drone, unit quaternion (w, x, y, z)."""
    props: Tensor  # (num_worlds, num_props, 3)
    """Of the task's props, in its order."""


class Renderer(Protocol):
    """Draws worlds of one scene."""

    def prepare(self, view: View) -> None:
        """Makes ready what a view needs; kernels may be left to the first picture.

        Raises:
            InputError: It can't draw such a view; the message says what it can draw.
        """
        ...

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Draws any number of worlds.

        Args:
            view: What is asked for.
            poses: Where everything is.
            appearance: How it looks; as in the model by default.

        Returns:
            What is asked for, by name. Shapes: (num_worlds, num_cameras, H, W, *). "rgb": uint8,
            3 numbers a pixel; "gray": float32, what the transform `GrayPixels` makes of these;
            "depth", "distance": float32, metres along the camera's axis or along the pixel's own
            ray, 0 where nothing is hit; "segmentation": int32, number of the geom, -1 where
            nothing is hit; "normals": float32, 3 numbers a pixel, the direction of length 1 in
            which the surface looks, world frame, all 0 where nothing is hit.

        Raises:
            InputError: It can't draw such a view.
        """
        ...

    def close(self) -> None:
        """Ends what it has started."""
        ...


class MakeRenderer(Protocol):
    """Makes a renderer of a scene."""

    def __call__(
        self, scene: Scene, *, num_worlds: int, num_shards: int | None, device: str
    ) -> Renderer:
        """Makes it.

        Args:
            scene: What will be drawn.
            num_worlds: About how many worlds are drawn in a call.
            num_shards: Shares of the batch, each on a thread; as it sees fit by default.
            device: Where pictures are wanted: "cpu", "cuda" or "cuda:N".
        """
        ...


_CLASSES = {
    "raytrace": "drone_rl.sim.rendering.raytrace.renderer.Raytracer",
    "mujoco_warp": "drone_rl.sim.rendering.mujoco_warp.WarpRenderer",
}
"""The class of each renderer, imported when it is needed."""


def find_renderer(which: str | MakeRenderer) -> MakeRenderer:
    """What makes a renderer.

    Args:
        which: Its name, see `RENDERERS`, or what makes it itself.

    Raises:
        InputError: There is none of that name.
    """
    if not isinstance(which, str):
        return which
    if which not in RENDERERS:
        raise InputError(f"renderer={which!r} is unknown; give one of: {', '.join(RENDERERS)}")
    module, _, name = _CLASSES[which].rpartition(".")
    return getattr(importlib.import_module(module), name)
