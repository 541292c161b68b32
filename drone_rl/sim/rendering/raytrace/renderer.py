"""The renderer `raytrace`: a ray tracer of simple solids under distant lights, on CPU and GPU.

Kernels by device and appearance: `plain_kernel` (CPU, flat colors), `effects_kernel` (CPU, with
fog, shadows, textures or a sky gradient) and `gpu_kernel` (both, on a GPU).
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels, on_torch_stream, start_warp
from drone_rl.sim.rendering.raytrace import effects_kernel, gpu_kernel, plain_kernel
from drone_rl.sim.rendering.raytrace import scene as scenes
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.materials import MaterialsEncoder
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import MODALITIES, Modality, View
from drone_rl.utils.errors import InputError

MODALITY_BITS: dict[Modality, int] = {name: getattr(structs, name.upper()) for name in MODALITIES}
"""Bit of each modality in `ViewArrays.what`."""
_VECTORS = {"rgb": wp.vec3ub, "normals": wp.vec3}
"""Warp types of modalities with several numbers per pixel."""


class Launch(NamedTuple):
    """Arguments of a launch."""

    num_images: int
    """Environments times cameras."""
    view: structs.ViewArrays
    geoms: structs.Geoms
    poses: structs.PoseArrays
    materials: structs.Materials
    images: Any = None
    """`structs.Images`, which kernels write."""
    effects: "structs.Effects | None" = None
    """Chooses the kernels with effects, if given."""

    def inputs(self, scratch: structs.Scratch) -> list[Any]:
        """Return the structs that kernels take last, in their order."""
        inputs = [self.poses, self.materials, scratch, self.images]
        return inputs if self.effects is None else [*inputs, self.effects]


class Raytracer:
    """Renders scenes of planes, boxes, balls, capsules, cylinders and ellipsoids."""

    def __init__(
        self, scene: Scene, *, num_envs: int, num_shards: int | None = None, device: str = "cpu"
    ) -> None:
        """Prepare a scene; the first image loads the kernels. See `RendererFactory`.

        `num_shards` is used on a CPU, and is the number of cores by default. Raises an `InputError`
        if the scene has unsupported geoms or lights, or there is no such device.
        """
        start_warp(device)
        if reason := scenes.why_not_simple(scene):
            raise InputError(f"{reason}, which Raytracer can't render; give renderer=raytrace")
        self.scene, self.device = scene, torch.device(device)
        is_cpu = self.device.type == "cpu"
        self._launcher = CpuLauncher(num_envs, num_shards) if is_cpu else GpuLauncher(device)
        self._frames, self._materials = scenes.Frames(scene), MaterialsEncoder(scene, device)
        self._views: dict[View, tuple[scenes.Cameras, structs.Geoms]] = {}
        self._poses = scenes.PoseBuffers(self.device)

    def prepare(self, view: View) -> None:
        """Build the kernels' structs of a view; see `Renderer.prepare`."""
        if view not in self._views:
            encoded, geoms = self._encode(view)
            self._views[view] = scenes.Cameras(view, encoded, self.device), geoms

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Render environments; see `Renderer.render`."""
        images = view.new_images(len(poses), self.device)
        with on_torch_stream(self.device):
            launch = self.encode(view, poses, appearance)
            self._launcher.launch(launch._replace(images=as_images(images)))
        return images

    def encode(self, view: View, poses: Poses, appearance: Appearance | None = None) -> Launch:
        """Return all arguments of kernels that render environments but the images.

        The next call overwrites the poses.
        """
        self.prepare(view)
        cameras, geoms = self._views[view]
        look = appearance or Appearance()
        materials, effects = self._materials.encode(appearance, len(poses))
        encoded = cameras.encode(look.camera, len(poses))
        frames = self._poses.write(poses, look.distractors)
        count = len(poses) * len(view.cameras)
        return Launch(count, encoded, geoms, frames, materials, effects=effects)

    def close(self) -> None:
        """Stop the threads."""
        self._launcher.close()

    def _encode(self, view: View) -> tuple[structs.ViewArrays, structs.Geoms]:
        view.check_modalities(self, MODALITY_BITS)
        device = str(self.device)
        with on_torch_stream(self.device):
            encoded = scenes.make_view(self.scene, self._frames, view, device)
            geoms = scenes.make_geoms(self.scene, self._frames, view.show_drone, device)
        encoded.what = sum({MODALITY_BITS[modality] for modality in view.modalities})
        return encoded, geoms


class CpuLauncher:
    """Launches the CPU kernels; each core renders one image at a time."""

    def __init__(self, num_envs: int, num_shards: int | None) -> None:
        self._workers = WorkerPool(num_envs, num_shards)
        self._scratch: dict[tuple[int, int], structs.Scratch] = {}

    def launch(self, launch: Launch) -> None:
        """Render images. The first call loads the kernels, which fused training does not need."""
        view, geoms = launch.view, launch.geoms
        size = (view.height * view.width, len(geoms.kind))
        if size not in self._scratch:
            self._scratch[size] = make_scratch(self._workers.size, *size)
        inputs = [view, geoms, *launch.inputs(self._scratch[size])]
        module, kernel = plain_kernel, plain_kernel.render_images
        if launch.effects is not None:
            module, kernel = effects_kernel, effects_kernel.render_images_with_effects
        load_kernels(module).result()

        def work(worker: int, first: int, last: int) -> None:
            wp.launch(kernel, 1, inputs=[first, last, worker, *inputs], device="cpu")

        self._workers.map_spans(0, launch.num_images, work)

    def close(self) -> None:
        """Stop the threads."""
        self._workers.close()


class GpuLauncher:
    """Launches the GPU kernels, one thread per pixel; they also run, slowly, on a CPU."""

    def __init__(self, device: str) -> None:
        self._device = device

    def launch(self, launch: Launch) -> None:
        """Render images."""
        view, geoms, device = launch.view, launch.geoms, self._device
        pixels, shape = view.height * view.width, (launch.num_images, len(geoms.kind))
        is_stored = launch.effects is not None or view.what & structs.DISTANCES
        scratch = make_scratch(launch.num_images, pixels if is_stored else 1, shape[1], device)
        inputs = [view, geoms, launch.poses, scratch]
        wp.launch(gpu_kernel.view_geoms, shape, inputs=inputs, device=device)
        kernel = gpu_kernel.render_pixels
        if launch.effects is not None:
            kernel = gpu_kernel.render_pixels_with_effects
        inputs = [view, *launch.inputs(scratch)]
        wp.launch(kernel, (launch.num_images, pixels), inputs=inputs, device=device)

    def close(self) -> None:
        """Do nothing: there are no threads."""


def make_scratch(count: int, pixels: int, geoms: int, device: str = "cpu") -> structs.Scratch:
    """Allocate scratch buffers for `count` images of some pixels and geoms at the same time."""
    scratch: Any = structs.Scratch()
    kinds: dict[str, Any] = {"nearest": float, "owner": int, "dark": int, "colors": wp.vec3ub}
    for name, kind in kinds.items():
        setattr(scratch, name, wp.empty((count, pixels), dtype=kind, device=device))
    kind: Any = structs.GeomView
    scratch.geom_views = wp.empty((count, geoms), dtype=kind, device=device)
    return scratch


def as_images(images: Mapping[Modality, Tensor]) -> structs.Images:
    """Return images by modality, (num_envs, num_cameras, H, W, *), for kernels to write."""
    encoded: Any = structs.Images()
    for modality, values in images.items():
        rows = values.flatten(2, 3).flatten(0, 1)
        setattr(encoded, modality, wp.from_torch(rows, dtype=_VECTORS.get(modality)))
    return encoded
