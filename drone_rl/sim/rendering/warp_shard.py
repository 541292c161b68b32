# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""Buffers and kernels of MuJoCo Warp that draw one share of a batch of worlds."""

import mujoco
import mujoco_warp as mjw
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance, each
from drone_rl.sim.rendering.devices import on_torch_stream
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.semantics import Meaning
from drone_rl.sim.rendering.view import View
from drone_rl.sim.rendering.warp_looks import Looks

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
