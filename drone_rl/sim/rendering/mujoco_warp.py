"""Pictures of many worlds at once by MuJoCo Warp's ray tracer: no OpenGL, CPU and GPU alike.

It draws any model, and is what `Raytracer` is held against.
"""

import dataclasses
import threading

import mujoco
import mujoco_warp as mjw
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance, Beside, Mounting, each, product
from drone_rl.sim.rendering.devices import Crew, on_torch_stream, start_warp
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Meaning, Scene
from drone_rl.sim.rendering.view import Modality, View, to_gray
from drone_rl.utils.errors import InputError

_KINDS = {
    "geom_rgba": wp.vec4,
    "geom_size": wp.vec3,
    "cam_pos": wp.vec3,
    "cam_quat": wp.quat,
    "light_ambient": wp.vec3,
    "light_diffuse": wp.vec3,
    "light_dir": wp.vec3,
}
"""What may differ from world to world, by its name in the model."""
_LIGHTS = {"ambient": "light_ambient", "sun": "light_diffuse", "sun_direction": "light_dir"}
"""What an appearance's lights are called in the model."""


class Looks:
    """Writes an appearance into a model, and takes it off again for the next call."""

    def __init__(self, scene: Scene, model: mjw.Model, capacity: int) -> None:
        """Gives each world colours and lights of its own, which all are the scene's.

        Args:
            scene: Whose things are coloured.
            model: Changed in place.
            capacity: Number of worlds.
        """
        self._scene = scene
        self._values: dict[str, Tensor] = {}
        for name, kind in _KINDS.items():
            values = wp.to_torch(getattr(model, name))[:1].repeat(capacity, 1, 1)
            setattr(model, name, wp.from_torch(values, dtype=kind))
            self._values[name] = values
        self._plain = {name: values[:1].clone() for name, values in self._values.items()}
        self._is_worn = False

    def wear(self, appearance: Appearance | None, num_worlds: int) -> None:
        """Makes the first worlds look so, and all others as in the scene.

        Args:
            appearance: As in the scene by default.
            num_worlds: As many as the appearance has.
        """
        if self._is_worn:
            for name, values in self._values.items():
                values[:] = self._plain[name]
        self._is_worn = appearance is not None
        if appearance is None:
            return
        self._color(appearance, num_worlds)
        if appearance.beside is not None:
            self._put_beside(appearance.beside.of(num_worlds))
        if appearance.camera is not None:
            self._mount(appearance.camera, num_worlds)

    def _color(self, appearance: Appearance, num_worlds: int) -> None:
        for meaning, color in appearance.colors.items():
            if meaning is not Meaning.SKY:
                geoms = self._scene.geoms(meaning)
                self._write("geom_rgba", geoms, each(color, num_worlds)[:, None])
        for name, value in appearance.lights(num_worlds).items():
            self._write(_LIGHTS[name], slice(None), value[:, None])

    def _put_beside(self, beside: Beside) -> None:
        geoms = self._scene.geoms(Meaning.DISTRACTOR)
        self._write("geom_rgba", geoms, beside.colors)
        edges = self._plain["geom_size"][:, geoms].to(beside.sizes)
        self._write("geom_size", geoms, beside.sizes[..., None] * edges)

    def _mount(self, mounting: Mounting, num_worlds: int) -> None:
        camera = [self._scene.camera(mounting.camera)]
        place, attitude = (self._plain[name][0, camera] for name in ("cam_pos", "cam_quat"))
        moved = place + torch.as_tensor(mounting.offset).to(place)
        turned = product(torch.as_tensor(mounting.turn).to(attitude), attitude)
        for name, value in (("cam_pos", moved), ("cam_quat", turned)):
            self._write(name, camera, value.expand(num_worlds, value.shape[-1])[:, None])

    def _write(self, name: str, where: list[int] | slice, value: Tensor) -> None:
        values = self._values[name]
        values[: len(value), where, : value.shape[-1]] = value.to(values)


_NOTHING_HIT = 0.0
"""Opacity of the sky's pixels, by which they are known; those of geoms are opaque."""


class Shard:
    """Buffers of a share of the batch."""

    def __init__(self, scene: Scene, view: View, camera: int, capacity: int) -> None:
        """Makes the buffers.

        Args:
            scene: What is drawn.
            view: How it is looked at, in one modality.
            camera: The view's only camera, by number.
            capacity: Most worlds in one call.
        """
        model = scene.model
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        (self._modality,) = view.modalities
        self._model = mjw.put_model(model)
        self._data = mjw.put_data(model, data, nworld=capacity)
        self._context = mjw.create_render_context(
            model,
            nworld=capacity,
            cam_res=(view.width, view.height),
            cam_active=[camera],
            render_rgb=self._modality == "rgb",
            render_depth=self._modality == "depth",
            render_seg=self._modality == "segmentation",
            enabled_geom_groups=sorted(
                {int(model.geom_group[i]) for i in scene.seen(view.show_drone)}
            ),
            background_color=(*scene.sky, _NOTHING_HIT),
            use_textures=False,
            enable_specular=False,
            enable_emission=False,
            enable_vertex_normals=False,
        )
        self._view = view
        self._qpos = wp.to_torch(self._data.qpos)
        self._mocap_pos = wp.to_torch(self._data.mocap_pos)
        self._pixels = self._buffer()
        self._looks = Looks(scene, self._model, capacity)

    def warm_up(self) -> None:
        """Compiles or loads the kernels now, on this thread: later calls may come from any."""
        self._launch(1)

    def share_kernel_of(self, other: "Shard") -> None:
        """Reuses a kernel specialised to the same model and view, which takes long to load."""
        self._context._megakernel = other._context._megakernel

    def draw(self, poses: Poses, appearance: Appearance | None, out: Tensor) -> None:
        """Draws the first rows of the buffers and copies them to `out`."""
        num_worlds = len(poses)
        self._qpos[:num_worlds] = torch.cat([poses.position, poses.attitude], dim=-1)
        self._mocap_pos[:num_worlds] = poses.props
        self._looks.wear(appearance, num_worlds)
        self._launch(num_worlds)
        out.copy_(self._unpack(self._pixels[:num_worlds]))
        if appearance is not None and self._modality == "rgb":
            self._fill_sky(appearance, out)

    def _launch(self, num_worlds: int) -> None:
        self._data.nworld = num_worlds
        with on_torch_stream(self._qpos.device):
            mjw.kinematics(self._model, self._data)
            mjw.camlight(self._model, self._data)
            mjw.refit_bvh(self._model, self._data, self._context)
            mjw.render(self._model, self._data, self._context)

    def _buffer(self) -> Tensor:
        """A torch view of what the kernel writes. First dimension: worlds."""
        context = self._context
        if self._modality == "depth":
            return wp.to_torch(context.depth_data)
        if self._modality == "segmentation":
            return wp.to_torch(context.seg_data)
        packed = context.rgb_data
        as_int = wp.array(
            ptr=packed.ptr, shape=packed.shape, dtype=wp.int32, device=packed.device, copy=False
        )
        return wp.to_torch(as_int).view(torch.uint8)

    def _fill_sky(self, appearance: Appearance, out: Tensor) -> None:
        """Colours the pixels in which nothing was hit."""
        sky = appearance.colors.get(Meaning.SKY)
        if sky is None:
            return
        rows = self._pixels[: len(out)].view(*out.shape[:-1], 4)
        color = (each(sky, len(out)) * 255).to(out.device, torch.uint8)
        torch.where(rows[..., 3:] == 0, color[:, None, None], out, out=out)

    def _unpack(self, rows: Tensor) -> Tensor:
        shape = (rows.shape[0], self._view.height, self._view.width)
        if self._modality == "depth":
            return rows.view(shape)
        if self._modality == "segmentation":
            return rows.view(*shape, 2)[..., 0]
        return rows.view(*shape, 4)[..., :3].flip(-1)  # packed as blue, green, red, alpha


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
