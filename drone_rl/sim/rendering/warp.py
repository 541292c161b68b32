"""Pictures of many worlds at once by MuJoCo Warp's ray tracer: no OpenGL, CPU and GPU alike.

It draws any model, and is what `Raytracer` is held against.
"""

import dataclasses
import threading

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.crew import Crew
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.gray import to_gray
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import Modality, View
from drone_rl.sim.rendering.warp_shard import Shard
from drone_rl.utils.errors import InputError

_BUILDING = threading.Lock()
"""Held while kernels are built, which Warp can't do twice at a time."""
DRAWN = ("rgb", "gray", "depth", "segmentation")
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
            InputError: The scene has no such camera, or a modality is not one of `DRAWN`.
        """
        view.check_modalities(self, DRAWN)
        for camera in view.cameras:
            for modality in view.modalities:
                self._shards_of(_single(view, camera, modality))

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Draws worlds, each camera and modality by itself; see `Renderer.render`.

        Raises:
            InputError: The appearance is more than flat colours and light.
        """
        if appearance is not None and not _is_drawn(appearance):
            raise InputError(
                "fog, shadows, textures, a sky of two colours, an exposure and other fields of "
                "view can't be drawn by WarpRenderer; give renderer=raytrace"
            )
        view.check_modalities(self, DRAWN)
        pictures = view.new_pictures(len(poses), self.device)
        for modality, several in pictures.items():
            for i, camera in enumerate(view.cameras):
                drawn = self._draw(_single(view, camera, modality), poses, appearance)
                several[:, i] = to_gray(drawn) if modality == "gray" else drawn
        return pictures

    def close(self) -> None:
        """Ends the threads."""
        self._crew.close()

    def _draw(self, single: View, poses: Poses, appearance: Appearance | None) -> Tensor:
        shards = self._shards_of(single)
        (out,) = single.new_pictures(len(poses), self.device).values()
        out = out[:, 0]

        def work(member: int, first: int, last: int) -> None:
            rows = slice(first, last)
            look = None if appearance is None else appearance[rows]
            shards[member].draw(poses[rows], look, out[rows])

        for first in range(0, len(poses), self._together):
            self._crew.share_out(first, min(first + self._together, len(poses)), work)
        return out

    def _shards_of(self, single: View) -> list[Shard]:
        if single not in self._shards:
            self._shards[single] = self._make_shards(single)
        return self._shards[single]

    def _make_shards(self, single: View) -> list[Shard]:
        camera = self.scene.camera(single.cameras[0])
        count = self._crew.size
        share = -(-self._together // count)
        with _BUILDING, wp.ScopedDevice(str(self.device)):
            shards = [Shard(self.scene, single, camera, share) for _ in range(count)]
            shards[0].warm_up()
        for shard in shards[1:]:
            shard.share_kernel_of(shards[0])
        return shards


def _is_drawn(appearance: Appearance) -> bool:
    zoom = None if appearance.camera is None else appearance.camera.zoom
    return appearance.is_plain and appearance.exposure is None and zoom is None


def _single(view: View, camera: str, modality: Modality) -> View:
    """A view of one camera and one modality, of which gray is made later."""
    drawn: Modality = "rgb" if modality == "gray" else modality
    return dataclasses.replace(view, cameras=(camera,), modalities=(drawn,))
