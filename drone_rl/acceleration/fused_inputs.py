"""Inputs of policies for the fused kernel: which it makes, and where they are in its memory."""

import math
from typing import Any

import torch
import warp as wp
from torch import Tensor
from torchrl.envs import CatFrames

from drone_rl.acceleration import rollout_kernel
from drone_rl.acceleration.packed_layers import starts
from drone_rl.acceleration.vectors_kernel import FLOWN, MEASURED, Vectors
from drone_rl.config.inputs import ImageInput
from drone_rl.envs import DroneEnv, Observer
from drone_rl.envs.camera_faults import Shift
from drone_rl.envs.observer import ImageSource, VectorSource
from drone_rl.envs.transforms import (
    ChromaticityPixels,
    CropRows,
    GrayPixels,
    RgbPixels,
    StandardizePixels,
)
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.raytrace.renderer import as_images, make_scratch
from drone_rl.sim.tasks import State

_AFTER: dict[type, tuple[type, ...]] = {
    CropRows: (),
    StandardizePixels: (),
    CatFrames: (),
    Shift: (CropRows, ChromaticityPixels, StandardizePixels),
    ChromaticityPixels: (StandardizePixels, CatFrames),
}
"""Transforms that the kernel has, each with those that it can't follow."""


def unfused_inputs(env: DroneEnv) -> list[str]:
    """Return reasons against fusing the inputs."""
    reasons = list[str]()
    for name, source in env.observer.sources.items():
        if isinstance(source, ImageSource):
            reasons += _unfused_image(source)
            continue
        quantity = source.seen.quantity
        if quantity not in MEASURED:
            reasons.append(f"input {quantity} is not fused")
        elif source.pipeline.stages or source.faults.stages:
            reasons.append(f"errors of input {name} are not fused")
        elif quantity in FLOWN and not isinstance(env.worlds.dynamics, Quadrotor):
            reasons.append(f"{quantity} without vehicle dynamics is not fused")
    return reasons


def _unfused_image(source: ImageSource) -> list[str]:
    first = next(map(type, source.transforms), None)
    if source.modality not in ("rgb", "depth"):
        return [f"input {source.modality} is not fused"]
    is_known = source.modality == "depth" or first in (GrayPixels, RgbPixels)
    if not is_known or source.faults.stages:
        return ["frames that are neither gray nor rgb are not fused"]
    reasons, before = list[str](), set[type]()
    for transform in source.pipeline.transforms:
        kind: Any = type(transform)
        is_known = kind in _AFTER and not before & {kind, *_AFTER[kind]}
        if kind is CatFrames:
            is_known &= (transform.dim, transform.padding) == (-3, "same")
        if not is_known:
            reasons.append(f"transform {kind.__name__} is not fused")
        before.add(kind)
    return reasons


class FusedImage:
    """An image, and its transforms, for the kernel."""

    def __init__(self, source: ImageSource) -> None:
        """Read the settings of the transforms."""
        self.source, self.view = source, source.view
        self._by_type = {type(t): t for t in source.pipeline.transforms}
        is_rgb = source.view.modalities == ("rgb",)
        self.num_channels = 1 + is_rgb + (is_rgb and ChromaticityPixels not in self._by_type)
        """Of a frame."""
        self.num_frames = source.pipeline.earlier + 1
        """Of an observation."""
        crop: Any = self._by_type.get(CropRows)
        self.visible = slice(0, self.view.height)
        """Rows of rendered frames that the policy sees."""
        if crop is not None:
            self.visible = slice(crop.values.top, crop.values.bottom)
        self.is_plain = source.view.modalities == ("gray",) and Shift not in self._by_type
        """Whether `show_plain` has them."""
        channels = self.num_channels * self.num_frames
        self.rendered = channels, self.view.height, self.view.width
        self.seen = channels, self.visible.stop - self.visible.start, self.view.width
        """Shape of the input."""
        self.camera: Any = rollout_kernel.CameraView()
        self._shifts = torch.zeros(0, 2, dtype=torch.int32)

    @property
    def frame_size(self) -> int:
        """Numbers of a frame."""
        return math.prod(self.rendered) // self.num_frames

    def write(self, first: int, num_envs: int, num_workers: int, num_geoms: int) -> None:
        """Write what does not change to `camera`; `first` is the place in observations."""
        camera, given, view = self.camera, self._by_type, self.view
        scale: Any = given.get(StandardizePixels)
        camera.mean, camera.deviation = (scale.values.mean, scale.values.std) if scale else (0, 1)
        chromaticity: Any = given.get(ChromaticityPixels)
        camera.floor = chromaticity.values.floor if chromaticity else 0.0
        seen = self.source.seen
        camera.maximum = (seen.maximum if isinstance(seen, ImageInput) else None) or 0.0
        camera.num_channels = self.num_channels
        camera.newest = first + (self.num_frames - 1) * self.frame_size
        self._shifts = torch.zeros(num_envs, 2, dtype=torch.int32)
        camera.shifts = wp.from_torch(self._shifts)
        camera.rendered = as_images(view.new_images(num_workers))
        camera.scratch = make_scratch(num_workers, view.height * view.width, num_geoms)

    def look(self, env: DroneEnv, started: State, look: Appearance | None) -> None:
        """Encode the appearance and the poses of the first environments."""
        camera, worlds = self.camera, env.worlds
        raytracer: Any = worlds.renderer
        launch = raytracer.encode(self.view, worlds.poses(started, look), look)
        camera.view, camera.geoms, camera.poses = launch.view, launch.geoms, launch.poses
        camera.materials, camera.has_effects = launch.materials, launch.effects is not None
        if launch.effects is not None:
            camera.effects = launch.effects

    def begin(self, rows: Tensor) -> None:
        """Sample the shifts of environments, (k,), whose episodes start, as `Observer` does."""
        shift: Any = self._by_type.get(Shift)
        for stage in self.source.pipeline.stages:
            if shift is not None and stage.model is shift.model:
                if len(rows):
                    stage(torch.zeros(len(rows), 1, 1, 1), rows, True)
                assert stage.memory is not None
                self._shifts[: len(stage.memory)] = stage.memory.int()


class FusedInputs:
    """All inputs for the kernel: an observation is a row, images first, then vectors."""

    def __init__(self, observer: Observer) -> None:
        """Lay out the inputs; see `unfused_inputs`."""
        self.images = {name: FusedImage(source) for name, source in observer.images.items()}
        every = observer.sources.items()
        self._vectors = {n: s.seen for n, s in every if isinstance(s, VectorSource)}
        lengths = {name: (seen.size,) for name, seen in self._vectors.items()}
        rendered = {name: image.rendered for name, image in self.images.items()} | lengths
        seen = {name: image.seen for name, image in self.images.items()} | lengths
        self._rendered, self.shapes = rendered, {name: seen[name] for name in observer.sources}
        """Shapes of rendered and, by name, of observed inputs."""
        sizes = [math.prod(shape) for shape in rendered.values()]
        self._seen, self.size = seen, sum(sizes)
        """Numbers of a row."""
        self._places = dict(zip(rendered, starts(sizes), strict=True))
        self.is_plain = [*(i.is_plain for i in self.images.values())] == [True]
        """Whether `show_plain` has them, without vectors."""
        self.is_plain &= not self._vectors
        self.num_frames = max((i.num_frames for i in self.images.values()), default=1)
        """Most frames of an image."""
        self.has_vectors = bool(self._vectors)

    @property
    def places(self) -> list[tuple[int, int]]:
        """See `PackedNetwork`."""
        found = list[tuple[int, int]]()
        for name, image in self.images.items():
            (_, height, width), (_, rows, _) = image.rendered, image.seen
            first = self._places[name] + image.visible.start * width
            found.append((first, (height - rows) * width))
        vectors = [self._places[name] for name in self._vectors]
        return [*found, *((first, 0) for first in vectors[:1])]

    def write(self, rollout: Any, num_envs: int, num_workers: int, num_geoms: int) -> None:
        """Write what does not change to a `Rollout`."""
        for name, image in self.images.items():
            image.write(self._places[name], num_envs, num_workers, num_geoms)
        stacks = [(self._places[n], i.frame_size, i.num_frames) for n, i in self.images.items()]
        rollout.stacks = wp.from_torch(torch.tensor(stacks, dtype=torch.int32).reshape(-1, 3))
        rollout.num_frames = self.num_frames
        vectors: Any = Vectors()
        kinds = [MEASURED.index(seen.quantity) for seen in self._vectors.values()]
        places = [self._places[name] for name in self._vectors]
        vectors.quantities = wp.from_torch(torch.tensor(kinds, dtype=torch.int32))
        vectors.places = wp.from_torch(torch.tensor(places, dtype=torch.int32))
        scales = [seen.scale for seen in self._vectors.values()]
        vectors.scales = wp.from_torch(torch.tensor(scales, dtype=torch.float32))
        rollout.vectors = vectors

    def look(self, rollout: Any, env: DroneEnv, started: State) -> None:
        """Encode the appearance and the poses of the first environments for a `Rollout`."""
        look = env.worlds.combine(env.appearances.current(torch.arange(len(started))))
        cameras = [image.camera for image in self.images.values()]
        for image in self.images.values():
            image.look(env, started, look)
        if self.is_plain:
            rollout.camera = cameras[0]
        else:
            rollout.cameras = wp.array(cameras, dtype=rollout_kernel.CameraView, device="cpu")
        rollout.poses = cameras[0].poses

    def seen(self, rows: Tensor) -> Tensor:
        """Return what policies see of rows, (*, size): without hidden rows of pixels."""
        if all(self._rendered[name] == shape for name, shape in self._seen.items()):
            return rows
        parts = list[Tensor]()
        for name, (first, shape) in self._located(self._rendered).items():
            part = rows[..., first : first + math.prod(shape)]
            if name in self.images:
                frames = part.unflatten(-1, shape)[..., self.images[name].visible, :]
                part = frames.flatten(-3)
            parts.append(part)
        return torch.cat(parts, -1)

    def by_name(self, seen: Tensor) -> dict[str, Tensor]:
        """Return views of what policies see, (*, numbers), by name."""
        located = self._located(self._seen)
        return {
            name: seen[..., first : first + math.prod(shape)].unflatten(-1, shape)
            for name, (first, shape) in ((name, located[name]) for name in self.shapes)
        }

    @staticmethod
    def _located(shapes: dict[str, tuple[int, ...]]) -> dict[str, tuple[int, tuple[int, ...]]]:
        places = starts(math.prod(shape) for shape in shapes.values())
        return {n: (at, shape) for (n, shape), at in zip(shapes.items(), places, strict=True)}

    def begin(self, rows: Tensor) -> None:
        """Sample what is sampled for environments, (k,), whose episodes start."""
        for image in self.images.values():
            image.begin(rows)
