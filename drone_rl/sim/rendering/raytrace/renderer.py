# pyright: reportGeneralTypeIssues=false
# pyright: reportCallIssue=false
# pyright: reportAttributeAccessIssue=false
# (Warp's structures are untyped.)
"""Pictures of many worlds at once, by a ray tracer of our own: no OpenGL, CPU and GPU alike.

MuJoCo Warp's ray tracer draws anything; this one draws what our worlds are made of, simple solids
under distant lights: the same pictures, twenty times as fast.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.devices import on_torch_stream, start_warp
from drone_rl.sim.rendering.raytrace import kernel as raytrace_kernel
from drone_rl.sim.rendering.raytrace import structs
from drone_rl.sim.rendering.raytrace.cameras import Cameras
from drone_rl.sim.rendering.raytrace.looks import Looks
from drone_rl.sim.rendering.raytrace.painters import CorePainter, GpuPainter, make_desk
from drone_rl.sim.rendering.raytrace.places import Places
from drone_rl.sim.rendering.raytrace.scene import Frames, check_scene, make_geoms, make_view
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import Modality, View

_BITS: Mapping[Modality, int] = MappingProxyType(
    {
        "rgb": structs.RGB,
        "gray": structs.GRAY,
        "depth": structs.DEPTH,
        "distance": structs.DISTANCE,
        "segmentation": structs.SEGMENTATION,
        "normals": structs.NORMALS,
    }
)
"""The kernels' bit of each modality."""
_PIXELS = MappingProxyType({"rgb": wp.vec3ub, "normals": wp.vec3})
"""Types of pixels of several numbers."""


class Raytracer:
    """Draws worlds of a scene of planes, boxes, balls, capsules, cylinders and ellipsoids."""

    def __init__(
        self, scene: Scene, *, num_worlds: int, num_shards: int | None = None, device: str = "cpu"
    ) -> None:
        """Notes what will be drawn; kernels are loaded with the first picture.

        Args:
            scene: What will be drawn.
            num_worlds: About how many worlds are drawn in a call.
            num_shards: Threads on a CPU; the number of cores by default.
            device: "cpu", "cuda" or "cuda:N".

        Raises:
            InputError: It can't draw the scene, or there is no such device.
        """
        start_warp(device)
        check_scene(scene)
        self.scene, self.device = scene, torch.device(device)
        is_cpu = self.device.type == "cpu"
        self._painter = CorePainter(num_worlds, num_shards) if is_cpu else GpuPainter(device)
        self._frames, self._looks = Frames(scene), Looks(scene, device)
        self._views: dict[View, tuple[Cameras, structs.Geoms]] = {}
        self._places = Places(self.device)

    def prepare(self, view: View) -> None:
        """Makes what kernels need for a view; kernels are loaded by the first picture.

        Raises:
            InputError: The scene has no such camera, or a modality is unknown.
        """
        if view not in self._views:
            made, geoms = self._make(view)
            self._views[view] = Cameras(view, made, self.device), geoms

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Draws worlds; see `Renderer.render`."""
        self.prepare(view)
        cameras, geoms = self._views[view]
        pictures = view.new_pictures(len(poses), self.device)
        with on_torch_stream(self.device):
            looks, scenery = self._looks.of(appearance, len(poses))
            made = cameras.of(None if appearance is None else appearance.camera, len(poses))
            count = len(poses) * len(view.cameras)
            there = self._places.of(poses, None if appearance is None else appearance.beside)
            drawn = _pictures(pictures)
            self._painter.paint(count, made, geoms, there, looks, drawn, scenery)
        return pictures

    def tools(self, view: View, num_workers: int) -> "Tools":
        """What a kernel of somebody else's draws with, as `raytrace_kernel.draw_picture` takes it.

        Args:
            view: That will be drawn, as the model looks.
            num_workers: At the same time.

        Raises:
            InputError: See `prepare`.
        """
        made, geoms = self._make(view)
        desk = make_desk(num_workers, view.height * view.width, len(geoms.kind))
        return Tools(made, geoms, self._looks.of(None, 1)[0], desk)

    def close(self) -> None:
        """Ends the threads."""
        self._painter.close()

    def _make(self, view: View) -> tuple[structs.View, structs.Geoms]:
        view.check_modalities(self, _BITS)
        where = str(self.device)
        with on_torch_stream(self.device):
            made = make_view(self.scene, self._frames, view, where)
            geoms = make_geoms(self.scene, self._frames, view.show_drone, where)
        made.what = sum({_BITS[modality] for modality in view.modalities})
        return made, geoms


class Tools(NamedTuple):
    """What draws one view on a CPU."""

    view: structs.View
    geoms: structs.Geoms
    looks: structs.Looks
    desk: raytrace_kernel.Desk


def _pictures(pictures: Mapping[Modality, Tensor]) -> structs.Pictures:
    made = structs.Pictures()
    for modality, values in pictures.items():
        rows = values.flatten(2, 3).flatten(0, 1)
        setattr(made, modality, wp.from_torch(rows, dtype=_PIXELS.get(modality)))
    return made
