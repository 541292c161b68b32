# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""Pictures of many worlds at once by MuJoCo Warp's ray tracer: no OpenGL, CPU and GPU alike.

A renderer holds no world. It is handed poses and returns pictures, so the cost is that of the
worlds asked for: a reset draws only the worlds that were reset, and a question such as "what would
the policy see with the cube over there" is one call.

Warp runs a CPU kernel on one core, and lets go of the interpreter's lock meanwhile: hence one
shard of the batch a core, each with its own buffers, on a pool of threads.
"""

from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

import mujoco
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import View
from drone_rl.sim.rendering.warp_shard import RECORDING, Shard
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.quiet import standard_error_closed

DRAWN = ("rgb", "depth", "segmentation")
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
        check_device(device)
        quiet = wp.LOG_ERROR if device == "cpu" else wp.LOG_WARNING  # no word about missing CUDA
        wp.config.log_level = max(wp.config.log_level, quiet)
        with standard_error_closed() if device == "cpu" else nullcontext():
            wp.init()  # its native part says that there is no CUDA, whatever the level
        self.scene = scene
        self.device = torch.device(device)
        wanted = 1 if self.device.type == "cuda" else num_shards or num_cores()
        self._share = -(-num_worlds // max(1, min(wanted, num_worlds)))
        self._count = -(-num_worlds // self._share)
        self._shards: dict[View, list[Shard]] = {}
        self._pool = None if self._count == 1 else ThreadPoolExecutor(self._count, "render")

    def prepare(self, view: View) -> None:
        """Makes buffers and kernels for a view.

        Raises:
            InputError: The scene has no such camera, or the modality is not one of `DRAWN`.
        """
        if view not in self._shards:
            self._shards[view] = self._make_shards(view)

    def render(self, view: View, poses: Poses, appearance: Appearance | None = None) -> Tensor:
        """Draws worlds; see `Renderer.render`."""
        self.prepare(view)
        out = self._new_output(view, len(poses))
        together = self._share * self._count
        for first in range(0, len(poses), together):
            self._render(view, poses, appearance, out, first, min(first + together, len(poses)))
        return out

    def close(self) -> None:
        """Ends the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _render(
        self,
        view: View,
        poses: Poses,
        appearance: Appearance | None,
        out: Tensor,
        first: int,
        last: int,
    ) -> None:
        """Draws a row of worlds, shared out evenly."""
        share = -(-(last - first) // self._count)
        spans = [slice(i, min(i + share, last)) for i in range(first, last, share)]
        jobs = [
            (shard, poses[span], _part(appearance, span), out[span])
            for shard, span in zip(self._shards[view], spans, strict=False)
        ]
        if self._pool is None or len(jobs) < 2:
            for job in jobs:
                Shard.draw(*job)
        else:
            for future in [self._pool.submit(Shard.draw, *job) for job in jobs]:
                future.result()

    def _make_shards(self, view: View) -> list[Shard]:
        if view.modality not in DRAWN:
            raise InputError(
                f"view {view.modality!r} can't be drawn by WarpRenderer; "
                f"ask for one of: {', '.join(DRAWN)}"
            )
        model = self.scene.model
        camera = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, view.camera)
        if camera < 0:
            names = ", ".join(model.camera(i).name for i in range(model.ncam))
            raise InputError(f"camera {view.camera!r} is not in the model; choose from: {names}")
        with RECORDING, wp.ScopedDevice(str(self.device)):
            shards = [Shard(self.scene, view, camera, self._share) for _ in range(self._count)]
            shards[0].warm_up()
        for shard in shards[1:]:
            shard.share_kernel_of(shards[0])
        return shards

    def _new_output(self, view: View, num_worlds: int) -> Tensor:
        shape, device = (num_worlds, view.height, view.width), self.device
        if view.modality == "rgb":
            return torch.empty(*shape, 3, dtype=torch.uint8, device=device)
        dtype = torch.float32 if view.modality == "depth" else torch.int32
        return torch.empty(shape, dtype=dtype, device=device)


def _part(appearance: Appearance | None, worlds: slice) -> Appearance | None:
    return None if appearance is None else appearance[worlds]


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
