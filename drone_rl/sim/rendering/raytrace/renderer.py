"""The renderer `raytrace`: a ray tracer of simple solids under distant lights, on CPU and GPU.

It renders the same images as `mujoco_warp`, about twenty times as fast, without OpenGL. Kernels by
device and appearance: `plain_kernel` (CPU, flat colours), `effects_kernel` (CPU, with fog,
shadows, textures or a sky gradient) and `gpu_kernel` (both, on a GPU).
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels, on_torch_stream, start_warp
from drone_rl.sim.rendering.raytrace import effects_kernel, gpu_kernel, plain_kernel
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.materials import MaterialsEncoder
from drone_rl.sim.rendering.raytrace.scene import (
    Cameras,
    Frames,
    PoseBuffers,
    check_scene,
    make_geoms,
    make_view,
)
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
_VECTORS = MappingProxyType({"rgb": wp.vec3ub, "normals": wp.vec3})
"""Warp types of modalities with several numbers per pixel."""


class KernelInputs(NamedTuple):
    """Arguments of `plain_kernel.render_image` for one view on a CPU."""

    view: structs.View
    geoms: structs.Geoms
    materials: structs.Materials
    scratch: structs.Scratch


class Raytracer:
    """Renders scenes of planes, boxes, balls, capsules, cylinders and ellipsoids."""

    def __init__(
        self, scene: Scene, *, num_worlds: int, num_shards: int | None = None, device: str = "cpu"
    ) -> None:
        """Prepare a scene; the first image loads the kernels.

        Args:
            scene: What to render.
            num_worlds: About how many environments one call renders.
            num_shards: Threads on a CPU; the number of cores by default.
            device: "cpu", "cuda" or "cuda:N".

        Raises:
            InputError: The scene has unsupported geoms or lights, or there is no such device.
        """
        start_warp(device)
        check_scene(scene)
        self.scene, self.device = scene, torch.device(device)
        is_cpu = self.device.type == "cpu"
        self._launcher = CpuLauncher(num_worlds, num_shards) if is_cpu else GpuLauncher(device)
        self._frames, self._materials = Frames(scene), MaterialsEncoder(scene, device)
        self._views: dict[View, tuple[Cameras, structs.Geoms]] = {}
        self._poses = PoseBuffers(self.device)

    def prepare(self, view: View) -> None:
        """Build the kernels' structs of a view.

        Raises:
            InputError: The scene has no such camera, or a modality is unknown.
        """
        if view not in self._views:
            encoded, geoms = self._encode(view)
            self._views[view] = Cameras(view, encoded, self.device), geoms

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Render environments; see `Renderer.render`."""
        self.prepare(view)
        cameras, geoms = self._views[view]
        images = view.new_images(len(poses), self.device)
        look = appearance or Appearance()
        with on_torch_stream(self.device):
            materials, effects = self._materials.encode(appearance, len(poses))
            encoded = cameras.encode(look.camera, len(poses))
            frames = self._poses.write(poses, look.distractors)
            count, out = len(poses) * len(view.cameras), _images(images)
            self._launcher.launch(count, encoded, geoms, frames, materials, out, effects)
        return images

    def kernel_inputs(self, view: View, num_workers: int) -> KernelInputs:
        """Return the arguments with which another kernel calls `plain_kernel.render_image`.

        Args:
            view: What to render, with the model's own appearance.
            num_workers: Images that are rendered at the same time.

        Raises:
            InputError: See `prepare`.
        """
        encoded, geoms = self._encode(view)
        scratch = make_scratch(num_workers, view.height * view.width, len(geoms.kind))
        return KernelInputs(encoded, geoms, self._materials.encode(None, 1)[0], scratch)

    def close(self) -> None:
        """Stop the threads."""
        self._launcher.close()

    def _encode(self, view: View) -> tuple[structs.View, structs.Geoms]:
        view.check_modalities(self, _BITS)
        device = str(self.device)
        with on_torch_stream(self.device):
            encoded = make_view(self.scene, self._frames, view, device)
            geoms = make_geoms(self.scene, self._frames, view.show_drone, device)
        encoded.what = sum({_BITS[modality] for modality in view.modalities})
        return encoded, geoms


class CpuLauncher:
    """Launches the CPU kernels; each core renders one image at a time."""

    def __init__(self, num_worlds: int, num_shards: int | None) -> None:
        """Start the threads; see `Raytracer`."""
        self._workers = WorkerPool(num_worlds, num_shards)
        self._scratch: dict[tuple[int, int], structs.Scratch] = {}

    def launch(
        self,
        count: int,
        view: structs.View,
        geoms: structs.Geoms,
        poses: structs.Poses,
        materials: structs.Materials,
        images: structs.Images,
        effects: "structs.Effects | None" = None,
    ) -> None:
        """Render images; kernels are loaded first, so that fused training need not load them.

        Args:
            count: Number of images: environments times cameras.
            view: Cameras and modalities.
            geoms: Of the scene.
            poses: Of all environments.
            materials: Colours and light.
            images: Written.
            effects: Chooses the kernels with effects, if given.
        """
        size = (view.height * view.width, len(geoms.kind))
        if size not in self._scratch:
            self._scratch[size] = make_scratch(self._workers.size, *size)
        module = plain_kernel if effects is None else effects_kernel
        load_kernels(module).result()
        if effects is None:
            kernel, inputs = plain_kernel.render_images, [view, geoms, poses, materials]
        else:
            kernel = effects_kernel.render_images_with_effects
            inputs = [view, geoms, poses, materials, effects]

        def work(worker: int, first: int, last: int) -> None:
            own = [first, last, worker, *inputs, self._scratch[size], images]
            wp.launch(kernel, 1, inputs=own, device="cpu")

        self._workers.map_spans(0, count, work)

    def close(self) -> None:
        """Stop the threads."""
        self._workers.close()


class GpuLauncher:
    """Launches the GPU kernels, one thread per pixel; they also run, slowly, on a CPU."""

    def __init__(self, device: str) -> None:
        """Take a device, "cuda" or "cuda:N"."""
        self._device = device

    def launch(
        self,
        count: int,
        view: structs.View,
        geoms: structs.Geoms,
        poses: structs.Poses,
        materials: structs.Materials,
        images: structs.Images,
        effects: "structs.Effects | None" = None,
    ) -> None:
        """Render images; see `CpuLauncher.launch`."""
        pixels = view.height * view.width
        shape = (count, len(geoms.kind))
        geom_views = _empty(shape, structs.GeomView, self._device)
        inputs = [view, geoms, poses, geom_views]
        wp.launch(gpu_kernel.view_geoms, shape, inputs=inputs, device=self._device)
        if effects is None:
            kernel, inputs = gpu_kernel.render_pixels, [view, geom_views, materials, images]
        else:
            scratch = make_scratch(count, pixels, 1, self._device)
            kernel = gpu_kernel.render_pixels_with_effects
            inputs = [view, poses, geom_views, materials, effects, scratch, images]
        wp.launch(kernel, (count, pixels), inputs=inputs, device=self._device)

    def close(self) -> None:
        """Do nothing: there are no threads."""


def make_scratch(num_workers: int, pixels: int, geoms: int, device: str = "cpu") -> structs.Scratch:
    """Allocate scratch buffers.

    Args:
        num_workers: Images that are rendered at the same time.
        pixels: Of an image.
        geoms: Number of rendered geoms.
        device: Of the kernels.
    """
    scratch: Any = structs.Scratch()
    kinds = {"nearest": float, "owner": int, "dark": int, "colors": wp.vec3ub}
    for name, kind in kinds.items():
        setattr(scratch, name, _empty((num_workers, pixels), kind, device))
    scratch.geom_views = _empty((num_workers, geoms), structs.GeomView, device)
    return scratch


def _empty(shape: tuple[int, int], kind: type, device: str) -> Any:
    return wp.empty(shape, dtype=kind, device=device)


def _images(images: Mapping[Modality, Tensor]) -> structs.Images:
    encoded: Any = structs.Images()
    for modality, values in images.items():
        rows = values.flatten(2, 3).flatten(0, 1)
        setattr(encoded, modality, wp.from_torch(rows, dtype=_VECTORS.get(modality)))
    return encoded
