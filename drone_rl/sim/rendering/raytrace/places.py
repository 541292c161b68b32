# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportCallIssue=false
# (Warp's structures are untyped.)
"""Where frames are, in arrays that the ray tracer's kernels know already.

To hand Warp new arrays with each picture would take longer than to fill these.
"""

from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Beside
from drone_rl.sim.rendering.raytrace import structs
from drone_rl.sim.rendering.renderer import Poses


class Places:
    """Frames of as many worlds as were drawn at a time: the world's, the drones', the props'."""

    def __init__(self, device: torch.device) -> None:
        """Makes room when poses come.

        Args:
            device: Of the kernels.
        """
        self._device = device
        self._places: Tensor = torch.empty(0, 0, 3)
        self._attitudes: Tensor = torch.empty(0, 4)
        self._scales: Tensor = torch.empty(0, 0)
        self._scaled: Any = None
        self._made = structs.Poses()

    def of(self, poses: Poses, beside: Beside | None = None) -> structs.Poses:
        """The same for the kernels; what it returned before is overwritten.

        Args:
            poses: Of any number of worlds.
            beside: The last of the props, whose sizes are not those of the model.
        """
        count, frames = len(poses), 2 + poses.props.shape[1]
        if len(self._places) < count or self._places.shape[1] != frames:
            self._make(count, frames)
        self._places[:count, 1] = poses.position
        self._places[:count, 2:] = poses.props
        self._attitudes[:count] = poses.attitude
        if beside is not None:
            sizes = beside.sizes
            self._scales[:count, frames - sizes.shape[-1] :] = sizes
            self._made.scales = self._scaled
        return self._made

    def _make(self, count: int, frames: int) -> None:
        self._places = torch.zeros(count, frames, 3, device=self._device)
        self._attitudes = torch.zeros(count, 4, device=self._device)
        self._scales = torch.ones(count, frames, device=self._device)
        self._scaled = wp.from_torch(self._scales)
        self._made = structs.Poses()
        self._made.places = wp.from_torch(self._places, dtype=wp.vec3)
        self._made.attitudes = wp.from_torch(self._attitudes, dtype=wp.vec4)
