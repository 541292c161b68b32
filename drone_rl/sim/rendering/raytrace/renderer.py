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
from drone_rl.sim.rendering.devices import Crew, loading, on_torch_stream, start_warp
from drone_rl.sim.rendering.raytrace import effects_kernel as raytrace_scenic
from drone_rl.sim.rendering.raytrace import gpu_kernel as raytrace_pixels
from drone_rl.sim.rendering.raytrace import gpu_kernel as raytrace_scenic_pixels
from drone_rl.sim.rendering.raytrace import plain_kernel as raytrace_kernel
from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.materials import Looks
from drone_rl.sim.rendering.raytrace.scene import (
    Cameras,
    Frames,
    Places,
    check_scene,
    make_geoms,
    make_view,
)
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import Modality, View


class CorePainter:
    """Draws a picture at a time on each core."""

    def __init__(self, num_worlds: int, num_shards: int | None) -> None:
        """Starts the threads; see `Raytracer`."""
        self._crew = Crew(num_worlds, num_shards)
        self._desks: dict[tuple[int, int], raytrace_kernel.Desk] = {}

    def paint(
        self,
        count: int,
        view: structs_kernel.View,
        geoms: structs_kernel.Geoms,
        poses: structs_kernel.Poses,
        looks: structs_kernel.Looks,
        pictures: structs_kernel.Pictures,
        scenery: "structs_kernel.Scenery | None" = None,
    ) -> None:
        """Draws pictures.

        Args:
            count: How many: one for each world and camera.
            view: What is asked for.
            geoms: What is drawn.
            poses: Where it is.
            looks: Colours and light.
            pictures: To draw into.
            scenery: What there is besides, if anything.
        """
        size = (view.height * view.width, len(geoms.kind))
        if size not in self._desks:
            self._desks[size] = make_desk(self._crew.size, *size)
        desk = self._desks[size]
        plain = scenery is None
        loading(raytrace_kernel if plain else raytrace_scenic).result()
        draw = raytrace_kernel.draw if plain else raytrace_scenic.draw_scenic
        given = [view, geoms, poses, looks, *([] if plain else [scenery]), desk, pictures]

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, *given]
            wp.launch(draw, 1, inputs=inputs, device="cpu")

        self._crew.share_out(0, count, work)

    def close(self) -> None:
        """Ends the threads."""
        self._crew.close()


class GpuPainter:
    """Draws all pixels at once, a thread each."""

    def __init__(self, device: str) -> None:
        """Takes the GPU, "cuda" or "cuda:N"; a CPU does, too, but slowly."""
        self._device = device

    def paint(
        self,
        count: int,
        view: structs_kernel.View,
        geoms: structs_kernel.Geoms,
        poses: structs_kernel.Poses,
        looks: structs_kernel.Looks,
        pictures: structs_kernel.Pictures,
        scenery: "structs_kernel.Scenery | None" = None,
    ) -> None:
        """See `CorePainter`."""
        pixels = view.height * view.width
        sights = wp.empty((count, len(geoms.kind)), dtype=structs_kernel.Sight, device=self._device)
        aimed = [view, geoms, poses, sights]
        wp.launch(raytrace_pixels.aim, sights.shape, inputs=aimed, device=self._device)
        if scenery is None:
            draw, drawn = raytrace_pixels.draw_pixels, [view, sights, looks, pictures]
        else:
            desk = make_desk(count, pixels, 1, self._device)
            draw = raytrace_scenic_pixels.draw_scenic_pixels
            drawn = [view, poses, sights, looks, scenery, desk, pictures]
        wp.launch(draw, (count, pixels), inputs=drawn, device=self._device)

    def close(self) -> None:
        """Ends nothing: there are no threads."""


def make_desk(
    num_workers: int, pixels: int, geoms: int, device: str = "cpu"
) -> raytrace_kernel.Desk:
    """Room to work.

    Args:
        num_workers: At the same time, a picture each.
        pixels: Of a picture.
        geoms: That are drawn.
        device: Where.
    """
    desk, size = raytrace_kernel.Desk(), (num_workers, pixels)
    desk.nearest = wp.empty(size, dtype=float, device=device)
    desk.owner, desk.dark = (wp.empty(size, dtype=int, device=device) for _ in range(2))
    desk.colors = wp.empty(size, dtype=wp.vec3ub, device=device)
    desk.sights = wp.empty((num_workers, geoms), dtype=structs_kernel.Sight, device=device)
    return desk


_BITS: Mapping[Modality, int] = MappingProxyType(
    {
        "rgb": structs_kernel.RGB,
        "gray": structs_kernel.GRAY,
        "depth": structs_kernel.DEPTH,
        "distance": structs_kernel.DISTANCE,
        "segmentation": structs_kernel.SEGMENTATION,
        "normals": structs_kernel.NORMALS,
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
        self._views: dict[View, tuple[Cameras, structs_kernel.Geoms]] = {}
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

    def _make(self, view: View) -> tuple[structs_kernel.View, structs_kernel.Geoms]:
        view.check_modalities(self, _BITS)
        where = str(self.device)
        with on_torch_stream(self.device):
            made = make_view(self.scene, self._frames, view, where)
            geoms = make_geoms(self.scene, self._frames, view.show_drone, where)
        made.what = sum({_BITS[modality] for modality in view.modalities})
        return made, geoms


class Tools(NamedTuple):
    """What draws one view on a CPU."""

    view: structs_kernel.View
    geoms: structs_kernel.Geoms
    looks: structs_kernel.Looks
    desk: raytrace_kernel.Desk


def _pictures(pictures: Mapping[Modality, Tensor]) -> structs_kernel.Pictures:
    made = structs_kernel.Pictures()
    for modality, values in pictures.items():
        rows = values.flatten(2, 3).flatten(0, 1)
        setattr(made, modality, wp.from_torch(rows, dtype=_PIXELS.get(modality)))
    return made
