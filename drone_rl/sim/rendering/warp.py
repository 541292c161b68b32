"""Pictures of many worlds at once by MuJoCo Warp's ray tracer: no OpenGL, CPU and GPU alike.

It draws any model, and is what `Raytracer` is held against.
"""

import threading

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.crew import Crew
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import View
from drone_rl.sim.rendering.warp_shard import Shard

_BUILDING = threading.Lock()
"""Held while kernels are built, which Warp can't do twice at a time."""
DRAWN = ("rgb", "depth", "segmentation")
"""Modalities that it knows."""


class WarpRenderer:
    """Draws worlds of a scene by any of its cameras, `num_worlds` of them at a time."""

    def __init__(
        self,
        scene: Scene,
        *,
        num_worlds: int,
        num_shards: int | None = None,
        device: str = "cpu",
    ) -> None:
        """Notes what will be drawn; buffers and kernels are made with the first picture of a view.

        Args:
            scene: What will be drawn.
            num_worlds: Most worlds that are drawn together; more are drawn in turn.
            num_shards: Shares of the batch, each on a thread; the number of cores by default, and
                one on a GPU.
            device: "cpu", "cuda" or "cuda:N".

        Raises:
            InputError: There is no such device.
        """
        start_warp(device)
        self.scene = scene
        self.device = torch.device(device)
        self._crew = Crew(num_worlds, 1 if self.device.type == "cuda" else num_shards)
        self._together = num_worlds
        self._shards: dict[View, list[Shard]] = {}

    def prepare(self, view: View) -> None:
        """Makes buffers and kernels for a view.

        Raises:
            InputError: The scene has no such camera, or the modality is not one of `DRAWN`.
        """
        if view not in self._shards:
            self._shards[view] = self._make_shards(view)

    def render(self, view: View, poses: Poses, appearance: Appearance | None = None) -> Tensor:
        """Draws worlds; see `Renderer.render`."""
        self.prepare(view)
        out = view.new_pictures(len(poses), self.device)
        shards = self._shards[view]

        def work(member: int, first: int, last: int) -> None:
            rows = slice(first, last)
            look = None if appearance is None else appearance[rows]
            shards[member].draw(poses[rows], look, out[rows])

        for first in range(0, len(poses), self._together):
            self._crew.share_out(first, min(first + self._together, len(poses)), work)
        return out

    def close(self) -> None:
        """Ends the threads."""
        self._crew.close()

    def _make_shards(self, view: View) -> list[Shard]:
        view.check_modality(self, DRAWN)
        camera = self.scene.camera(view.camera)
        count = self._crew.size
        share = -(-self._together // count)
        with _BUILDING, wp.ScopedDevice(str(self.device)):
            shards = [Shard(self.scene, view, camera, share) for _ in range(count)]
            shards[0].warm_up()
        for shard in shards[1:]:
            shard.share_kernel_of(shards[0])
        return shards
