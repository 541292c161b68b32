"""Pictures of many worlds at once by MuJoCo Warp's ray tracer: no OpenGL, CPU and GPU alike.

A renderer holds no world. It is handed poses and returns pictures, so the cost is that of the
worlds asked for: a reset draws only the worlds that were reset, and a question such as "what would
the policy see with the cube over there" is one call.

Warp runs a CPU kernel on one core, and lets go of the interpreter's lock meanwhile: hence one
shard of the batch a core, each with its own buffers, on a pool of threads. A CPU's shard records
the kernels of a frame once for each number of worlds and then replays them, which spares Python the
packing of some hundred arguments: a single world is drawn several times as fast.
"""

import dataclasses
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from typing import Literal

import mujoco
import mujoco_warp as mjw
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.drone import BODY_GROUP
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import num_cores

_RECORDING = threading.Lock()
"""Held while kernels are recorded or built: Warp records whatever any thread launches."""

Modality = Literal["rgb", "depth", "segmentation"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class View:
    """One camera's picture of every world.

    Raises:
        InputError: The size is out of range or the modality unknown.
    """

    camera: str
    """Full name of the camera in the model, such as "drone/front_center"."""
    height: int
    width: int
    modality: Modality = "rgb"
    show_drone: bool = False
    """Whether the drone's own body is drawn; its own cameras leave it out."""

    def __post_init__(self) -> None:
        """Refuses what can't be drawn."""
        if self.modality not in ("rgb", "depth", "segmentation"):
            raise InputError(
                f"modality={self.modality!r} is unknown; give rgb, depth or segmentation"
            )
        if not (1 <= self.height <= 4096 and 1 <= self.width <= 4096):
            raise InputError(f"view of {self.height}x{self.width} pixels; give 1 to 4096 each way")


class WarpRenderer:
    """Draws one `View` of up to `max_worlds` worlds of a compiled model in a call."""

    def __init__(
        self,
        model: mujoco.MjModel,
        view: View,
        *,
        max_worlds: int,
        num_shards: int | None = None,
        device: str = "cpu",
        background: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Prepares buffers and kernels.

        Args:
            model: The compiled model, as both simulators share it.
            view: What to draw.
            max_worlds: Most worlds in one call.
            num_shards: Shares of the batch, each on a thread; the number of cores by default, and
                one on a GPU.
            device: "cpu", "cuda" or "cuda:N".
            background: Red, green, blue in [0, 1] where a ray hits nothing.

        Raises:
            InputError: The model has no such camera, or there is no such device.
        """
        check_device(device)
        quiet = wp.LOG_ERROR if device == "cpu" else wp.LOG_WARNING  # no word about missing CUDA
        wp.config.log_level = max(wp.config.log_level, quiet)
        self.view = view
        self.device = torch.device(device)
        on_gpu = self.device.type == "cuda"
        wanted = 1 if on_gpu else num_shards or num_cores()
        capacity = -(-max_worlds // max(1, min(wanted, max_worlds)))
        self._capacity = capacity
        count = -(-max_worlds // capacity)
        camera = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, view.camera)
        if camera < 0:
            names = ", ".join(model.camera(i).name for i in range(model.ncam))
            raise InputError(f"camera {view.camera!r} is not in the model; choose from: {names}")
        with _RECORDING, wp.ScopedDevice(device):
            self._shards = [_Shard(model, view, camera, capacity, background) for _ in range(count)]
            self._shards[0].warm_up()
        for shard in self._shards[1:]:
            shard.share_kernel_of(self._shards[0])
        self._pool = None if count == 1 else ThreadPoolExecutor(count, "render")

    def render(self, qpos: Tensor, mocap_pos: Tensor) -> Tensor:
        """Draws worlds.

        Args:
            qpos: Generalised positions. Shape: (num_worlds, nq).
            mocap_pos: Positions of the mocap bodies, metres. Shape: (num_worlds, nmocap, 3).

        Returns:
            On the renderer's device, by modality: "rgb" uint8 (num_worlds, H, W, 3); "depth"
            float32 (num_worlds, H, W), metres along the optical axis, 0 where nothing is hit;
            "segmentation" int32 (num_worlds, H, W), geom id, -1 where nothing is hit.

        Raises:
            ValueError: More worlds than `max_worlds`.
        """
        num_worlds = qpos.shape[0]
        if num_worlds > self._capacity * len(self._shards):
            raise ValueError(f"{num_worlds} worlds in a renderer made for fewer; raise max_worlds")
        out = self._new_output(num_worlds)
        share = max(1, -(-num_worlds // len(self._shards)))
        spans = [slice(i, min(i + share, num_worlds)) for i in range(0, num_worlds, share)]
        jobs = [
            (shard, qpos[span], mocap_pos[span], out[span])
            for shard, span in zip(self._shards, spans, strict=False)
        ]
        if self._pool is None or len(jobs) < 2:
            for job in jobs:
                _Shard.draw(*job)
        else:
            for future in [self._pool.submit(_Shard.draw, *job) for job in jobs]:
                future.result()
        return out

    def close(self) -> None:
        """Ends the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _new_output(self, num_worlds: int) -> Tensor:
        shape, device = (num_worlds, self.view.height, self.view.width), self.device
        if self.view.modality == "rgb":
            return torch.empty(*shape, 3, dtype=torch.uint8, device=device)
        dtype = torch.float32 if self.view.modality == "depth" else torch.int32
        return torch.empty(shape, dtype=dtype, device=device)


class _Shard:
    """Buffers of a share of the batch."""

    def __init__(
        self,
        model: mujoco.MjModel,
        view: View,
        camera: int,
        capacity: int,
        background: Sequence[float],
    ) -> None:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        self._model = mjw.put_model(model)
        self._data = mjw.put_data(model, data, nworld=capacity)
        groups = sorted(
            {int(g) for g in model.geom_group} - (set() if view.show_drone else {BODY_GROUP})
        )
        self._context = mjw.create_render_context(
            model,
            nworld=capacity,
            cam_res=(view.width, view.height),
            cam_active=[camera],
            render_rgb=view.modality == "rgb",
            render_depth=view.modality == "depth",
            render_seg=view.modality == "segmentation",
            enabled_geom_groups=groups,
            background_color=(*background, 1.0),
            use_textures=False,
            enable_specular=False,
            enable_emission=False,
            enable_vertex_normals=False,
        )
        self._view = view
        self._qpos = wp.to_torch(self._data.qpos)
        self._mocap_pos = wp.to_torch(self._data.mocap_pos)
        self._pixels = self._buffer()
        self._graphs: dict[int, wp.Graph] = {}

    def warm_up(self) -> None:
        """Compiles or loads the kernels now, on this thread: later calls may come from any."""
        self._launch(1)

    def share_kernel_of(self, other: "_Shard") -> None:
        """Reuses a kernel specialised to the same model and view, which takes long to load."""
        self._context._megakernel = other._context._megakernel

    def draw(self, qpos: Tensor, mocap_pos: Tensor, out: Tensor) -> None:
        """Draws the first rows of the buffers and copies them to `out`."""
        num_worlds = qpos.shape[0]
        self._qpos[:num_worlds] = qpos
        self._mocap_pos[:num_worlds] = mocap_pos
        if self._qpos.is_cpu:
            wp.capture_launch(self._graph(num_worlds))
        else:
            self._launch(num_worlds)
        out.copy_(self._unpack(self._pixels[:num_worlds]))

    def _graph(self, num_worlds: int) -> wp.Graph:
        """The recorded launches of the first rows."""
        if num_worlds not in self._graphs:
            with _RECORDING, wp.ScopedCapture("cpu") as capture:
                self._launch(num_worlds)
            self._graphs[num_worlds] = capture.graph
        return self._graphs[num_worlds]

    def _launch(self, num_worlds: int) -> None:
        self._data.nworld = num_worlds
        with _on_torch_stream(self._qpos.device):
            mjw.kinematics(self._model, self._data)
            mjw.camlight(self._model, self._data)
            mjw.refit_bvh(self._model, self._data, self._context)
            mjw.render(self._model, self._data, self._context)

    def _buffer(self) -> Tensor:
        """A torch view of what the kernel writes. First dimension: worlds."""
        context = self._context
        if self._view.modality == "depth":
            return wp.to_torch(context.depth_data)
        if self._view.modality == "segmentation":
            return wp.to_torch(context.seg_data)
        packed = context.rgb_data
        as_int = wp.array(
            ptr=packed.ptr, shape=packed.shape, dtype=wp.int32, device=packed.device, copy=False
        )
        return wp.to_torch(as_int).view(torch.uint8)

    def _unpack(self, rows: Tensor) -> Tensor:
        shape = (rows.shape[0], self._view.height, self._view.width)
        if self._view.modality == "depth":
            return rows.view(shape)
        if self._view.modality == "segmentation":
            return rows.view(*shape, 2)[..., 0]
        return rows.view(*shape, 4)[..., :3].flip(-1)  # packed as blue, green, red, alpha


def _on_torch_stream(device: torch.device) -> AbstractContextManager:
    """Puts Warp's launches in order with torch's on a GPU; a CPU has no streams."""
    if device.type == "cpu":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))


def check_device(device: str) -> None:
    """Refuses a device that this machine lacks.

    Raises:
        InputError: It is neither "cpu" nor a CUDA device that is there.
    """
    kind = device.split(":")[0]
    if kind not in ("cpu", "cuda"):
        raise InputError(f"device={device} is unknown; give cpu, cuda or cuda:N")
    if kind == "cuda" and not (torch.cuda.is_available() and wp.get_cuda_device_count()):
        raise InputError(f"device={device}, but no CUDA GPU is usable here; give device=cpu")
