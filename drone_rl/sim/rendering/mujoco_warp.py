"""The renderer `mujoco_warp`: MuJoCo Warp's ray tracer, which renders any model on CPU and GPU."""

import dataclasses
import threading
from typing import Any

import mujoco as _mujoco
import mujoco_warp as mjw
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance, Mounting, expand_color, product
from drone_rl.sim.rendering.devices import WorkerPool, on_torch_stream, start_warp
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene, SemanticClass
from drone_rl.sim.rendering.view import Modality, View, to_gray
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
SUPPORTED = ("rgb", "gray", "depth", "segmentation")
_BUILDING = threading.Lock()
"""Held while kernels are built: Warp builds one at a time."""
_SKY_OPACITY = 0.0
"""Marks pixels in which nothing is hit; those of geoms are opaque."""
_KINDS = {
    "geom_rgba": wp.vec4,
    "geom_size": wp.vec3,
    "cam_pos": wp.vec3,
    "cam_quat": wp.quat,
    "light_ambient": wp.vec3,
    "light_diffuse": wp.vec3,
    "light_dir": wp.vec3,
}
"""Arrays of the model that may differ between environments."""
_LIGHTS = {"ambient": "light_ambient", "sun": "light_diffuse", "sun_direction": "light_dir"}
"""The model's names of an appearance's lights."""


class WarpRenderer:
    """Renders environments by any camera of a scene, `num_envs` at a time."""

    def __init__(
        self, scene: Scene, *, num_envs: int, num_shards: int | None = None, device: str = "cpu"
    ) -> None:
        """See `RendererFactory`; batches larger than `num_envs` are rendered in turn."""
        start_warp(device)
        self.scene = scene
        self.device = torch.device(device)
        self._workers = WorkerPool(num_envs, 1 if self.device.type == "cuda" else num_shards)
        self._capacity = num_envs
        self._shards: dict[View, list[Shard]] = {}

    def prepare(self, view: View) -> None:
        """Allocate buffers and build kernels; see `Renderer.prepare` and `SUPPORTED`."""
        check_view(self, view)
        for camera in view.cameras:
            for modality in view.modalities:
                self._shards_of(_single(view, camera, modality))

    def render(
        self, view: View, poses: Poses, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """See `Renderer.render`; appearances may not have fog, shadows or textures."""
        if appearance is not None and not _is_supported(appearance):
            raise InputError(
                "fog, shadows, textures, a sky of two colors, an exposure and other fields of "
                "view can't be rendered by WarpRenderer; give renderer=raytrace"
            )
        check_view(self, view)
        images = view.new_images(len(poses), self.device)
        for modality, several in images.items():
            for i, camera in enumerate(view.cameras):
                image = self._render(_single(view, camera, modality), poses, appearance)
                several[:, i] = to_gray(image) if modality == "gray" else image
        return images

    def close(self) -> None:
        """Stop the threads."""
        self._workers.close()

    def _render(self, single: View, poses: Poses, appearance: Appearance | None) -> Tensor:
        shards = self._shards_of(single)
        out = next(iter(single.new_images(len(poses), self.device).values()))[:, 0]

        def work(worker: int, first: int, last: int) -> None:
            rows = slice(first, last)
            look = None if appearance is None else appearance[rows]
            shards[worker].render(poses[rows], look, out[rows])

        for first in range(0, len(poses), self._capacity):
            self._workers.map_spans(first, min(first + self._capacity, len(poses)), work)
        return out

    def _shards_of(self, single: View) -> "list[Shard]":
        if single not in self._shards:
            camera, count = self.scene.camera(single.cameras[0]), self._workers.size
            capacity = -(-self._capacity // count)
            with _BUILDING, wp.ScopedDevice(str(self.device)):
                shards = [Shard(self.scene, single, camera, capacity) for _ in range(count)]
                for shard in shards:
                    shard.launch(1)  # compiles or loads the kernels, which is not thread-safe
            self._shards[single] = shards
        return self._shards[single]


class Shard:
    """Buffers and kernels of one worker's part of the batch."""

    def __init__(self, scene: Scene, view: View, camera: int, capacity: int) -> None:
        """Allocate buffers for at most `capacity` environments, one camera and one modality."""
        model = scene.model
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        (self._modality,) = view.modalities
        self._model: Any = mjw.put_model(model)
        self._data: Any = mjw.put_data(model, data, nworld=capacity)
        self._context: Any = mjw.create_render_context(
            model,
            nworld=capacity,
            cam_res=(view.width, view.height),
            cam_active=[camera],
            render_rgb=self._modality == "rgb",
            render_depth=self._modality == "depth",
            render_seg=self._modality == "segmentation",
            enabled_geom_groups=sorted({*map(int, model.geom_group[scene.shown(view.show_drone)])}),
            background_color=(*scene.sky, _SKY_OPACITY),
            use_textures=False,
            enable_specular=False,
            enable_emission=False,
            enable_vertex_normals=False,
        )
        self._qpos = wp.to_torch(self._data.qpos)
        self._mocap_pos = wp.to_torch(self._data.mocap_pos)
        self._pixels = self._buffer(view.height, view.width)
        self._appearance = ModelAppearance(scene, self._model, capacity)

    def render(self, poses: Poses, appearance: Appearance | None, out: Tensor) -> None:
        """Render the first rows of the buffers and copy them to `out`."""
        num_envs = len(poses)
        self._qpos[:num_envs] = torch.cat([poses.position, poses.attitude], dim=-1)
        self._mocap_pos[:num_envs] = poses.props
        self._appearance.apply(appearance, num_envs)
        self.launch(num_envs)
        rows = self._pixels[:num_envs]
        is_rgb = self._modality == "rgb"
        out.copy_(rows[..., :3].flip(-1) if is_rgb else rows)
        sky = None if appearance is None else appearance.colors.get(SemanticClass.SKY)
        if sky is not None and is_rgb:
            color = (expand_color(sky, len(out)) * 255).to(out.device, torch.uint8)
            torch.where(rows[..., 3:] == 0, color[:, None, None], out, out=out)

    def launch(self, num_envs: int) -> None:
        """Render to the buffers; the first launch compiles or loads the kernels."""
        self._data.nworld = num_envs
        with on_torch_stream(self._qpos.device):
            mjw.kinematics(self._model, self._data)
            mjw.camlight(self._model, self._data)
            mjw.refit_bvh(self._model, self._data, self._context)
            mjw.render(self._model, self._data, self._context)

    def _buffer(self, height: int, width: int) -> Tensor:
        """The kernel's output, (capacity, height, width, *); blue, green, red, alpha for RGB."""
        context = self._context
        if self._modality == "depth":
            return wp.to_torch(context.depth_data).view(-1, height, width)
        if self._modality == "segmentation":
            return wp.to_torch(context.seg_data).view(-1, height, width, 2)[..., 0]
        packed = context.rgb_data
        as_int = wp.array(
            ptr=packed.ptr, shape=packed.shape, dtype=wp.int32, device=packed.device, copy=False
        )
        return wp.to_torch(as_int).view(torch.uint8).view(-1, height, width, 4)


class ModelAppearance:
    """Writes an appearance into MuJoCo Warp's model; restores the model before the next one."""

    def __init__(self, scene: Scene, model: Any, capacity: int) -> None:
        """Give each of `capacity` environments its own values in an `mjw.Model`."""
        self._scene = scene
        self._values: dict[str, Tensor] = {}
        for name, kind in _KINDS.items():
            values = wp.to_torch(getattr(model, name))[:1].repeat(capacity, 1, 1)
            setattr(model, name, wp.from_torch(values, dtype=kind))
            self._values[name] = values
        self._plain = {name: values[:1].clone() for name, values in self._values.items()}
        self._is_applied = False

    def apply(self, appearance: Appearance | None, num_envs: int) -> None:
        """Write the appearance of the first `num_envs` environments; others get the scene's."""
        if self._is_applied:
            for name, values in self._values.items():
                values[:] = self._plain[name]
        self._is_applied = appearance is not None
        if appearance is not None:
            self._write_colors(appearance, num_envs)
            if appearance.camera is not None:
                self._mount(appearance.camera, num_envs)

    def _write_colors(self, appearance: Appearance, num_envs: int) -> None:
        for semantic_class, color in appearance.colors.items():
            if semantic_class is not SemanticClass.SKY:
                geoms = self._scene.geoms(semantic_class)
                self._write("geom_rgba", geoms, expand_color(color, num_envs)[:, None])
        for name, value in appearance.lights(num_envs).items():
            self._write(_LIGHTS[name], slice(None), value[:, None])
        if appearance.distractors is not None:
            distractors = appearance.distractors.expand(num_envs)
            geoms = self._scene.geoms(SemanticClass.DISTRACTOR)
            self._write("geom_rgba", geoms, distractors.colors)
            edges = self._plain["geom_size"][:, geoms].to(distractors.sizes)
            self._write("geom_size", geoms, distractors.sizes[..., None] * edges)

    def _mount(self, mounting: Mounting, num_envs: int) -> None:
        camera = [self._scene.camera(mounting.camera)]
        place, attitude = (self._plain[name][0, camera] for name in ("cam_pos", "cam_quat"))
        moved = place + torch.as_tensor(mounting.offset).to(place)
        turned = product(torch.as_tensor(mounting.turn).to(attitude), attitude)
        for name, value in (("cam_pos", moved), ("cam_quat", turned)):
            self._write(name, camera, value.expand(num_envs, value.shape[-1])[:, None])

    def _write(self, name: str, where: list[int] | slice, value: Tensor) -> None:
        values = self._values[name]
        values[: len(value), where, : value.shape[-1]] = value.to(values)


def _is_supported(appearance: Appearance) -> bool:
    zoom = None if appearance.camera is None else appearance.camera.zoom
    return appearance.is_plain and appearance.exposure is None and zoom is None


def check_view(renderer: object, view: View) -> None:
    """Raise an `InputError` for a view that this renderer does not support."""
    view.check_modalities(renderer, SUPPORTED)
    if view.horizontal_fov is not None:
        raise InputError(
            "inputs with cameras of their own can't be rendered by mujoco_warp; give "
            "renderer=raytrace"
        )


def _single(view: View, camera: str, modality: Modality) -> View:
    """A view of one camera and one modality; gray is computed from RGB."""
    rendered: Modality = "rgb" if modality == "gray" else modality
    return dataclasses.replace(view, cameras=(camera,), modalities=(rendered,))
