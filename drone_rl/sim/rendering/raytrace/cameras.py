# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportCallIssue=false
# (Warp's structures are untyped.)
"""Cameras that differ from world to world, for the ray tracer's kernels."""

import numpy as np
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.mounting import Mounting, product
from drone_rl.sim.rendering.raytrace import structs
from drone_rl.sim.rendering.view import View


class Cameras:
    """Those of a view, as they are in the model and as they are mounted otherwise."""

    def __init__(self, view: View, made: structs.View, device: torch.device) -> None:
        """Takes the model's.

        Args:
            view: What is asked for.
            made: The same for the kernels.
            device: Of the kernels.
        """
        self._view, self._made, self._device = view, made, device
        self._cameras = made.cameras.numpy()
        self._rays, self._cosines = wp.to_torch(made.rays), wp.to_torch(made.cosines)
        self._last: tuple[Mounting | None, int, structs.View] = (None, 0, made)

    def of(self, mounting: Mounting | None, num_worlds: int) -> structs.View:
        """The view for the kernels.

        Args:
            mounting: As in the model by default; one that was given before is not read again.
            num_worlds: As many as it has.
        """
        if mounting is None or mounting.camera not in self._view.cameras:
            return self._made
        if self._last[0] is not mounting or self._last[1] != num_worlds:
            self._last = (mounting, num_worlds, self._mounted(mounting, num_worlds))
        return self._last[2]

    def _mounted(self, mounting: Mounting, num_worlds: int) -> structs.View:
        which = self._view.cameras.index(mounting.camera)
        cameras = np.tile(self._cameras, (num_worlds, 1))
        one = cameras[:, which]
        one["position"] += _array(mounting.offset)
        attitude = torch.tensor(one["attitude"]).double()
        turn = torch.as_tensor(mounting.turn, dtype=torch.float64).cpu()
        one["attitude"] = product(turn, attitude).numpy()
        made = structs.View()
        for name in ("count", "width", "height", "far", "what"):
            setattr(made, name, getattr(self._made, name))
        rays, cosines = (
            self._of_each(values, num_worlds) for values in (self._rays, self._cosines)
        )
        if mounting.zoom is not None:
            for name in ("half_width", "half_height"):
                one[name] /= _array(mounting.zoom)
            rays = rays.clone()
            rays[which :: len(self._view.cameras)] = self._rays_of(which, mounting.zoom)
            cosines = -rays[..., 2].contiguous()
        where = str(self._device)
        made.cameras = wp.array(cameras.reshape(-1), dtype=structs.Camera, device=where)
        made.rays = wp.from_torch(rays, dtype=wp.vec3)
        made.cosines = wp.from_torch(cosines)
        return made

    def _of_each(self, values: Tensor, num_worlds: int) -> Tensor:
        """The same for every world, without a copy where there is one camera."""
        if len(values) == 1:
            return values.expand(num_worlds, *values.shape[1:])
        return values.repeat(num_worlds, *[1] * (values.dim() - 1))

    def _rays_of(self, which: int, zoom: float | Tensor) -> Tensor:
        """Directions through the same pixels. Shape: (num_worlds or 1, pixels, 3)."""
        rays = self._rays[which]
        flat = rays / -rays[:, 2:]
        much = torch.as_tensor(zoom, dtype=torch.float32).to(self._device).reshape(-1, 1)
        wide = torch.stack([flat[:, 0] / much, flat[:, 1] / much], -1)
        wide = torch.nn.functional.pad(wide, (0, 1), value=-1.0)
        return wide / wide.norm(dim=-1, keepdim=True)


def _array(value: object) -> np.ndarray:
    return torch.as_tensor(value).cpu().numpy()
