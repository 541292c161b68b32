"""Forward pass of a small network on one core, in half of torch's time."""

import sys
import threading
from typing import Self

import torch
import warp as wp
from torch import Tensor, nn

from drone_rl.acceleration.layers_kernel import Layers, run_convolutions, run_linear
from drone_rl.acceleration.packed_layers import PackedNetwork, unsupported
from drone_rl.envs.direct_renderer import Reasons
from drone_rl.policies.networks import PolicyNetwork, check_shape, require_finite
from drone_rl.sim.rendering.devices import load_kernels, start_warp

_TOGETHER = wp.constant(16)
"""Frames whose linear layers are computed together."""

wp.set_module_options({"enable_backward": False})


@wp.kernel
def infer(
    layers: Layers, frames: wp.array2d[float], workspace: wp.array[float], logits: wp.array2d[float]
) -> None:
    """Compute the logits of frames, a row each; launch it with a dimension of 1."""
    for first in range(0, frames.shape[0], _TOGETHER):
        count = wp.min(frames.shape[0] - first, _TOGETHER)
        for row in range(count):
            run_convolutions(layers, frames[first + row], workspace, row)
        run_linear(layers, workspace, count)
        for row in range(count):
            at = layers.logits_offset + row * layers.logits_stride
            for action in range(logits.shape[1]):
                logits[first + row, action] = workspace[at + action]


class BatchedInference:
    """Computes the logits of a network that no longer learns; any thread may call it."""

    def __init__(self, network: nn.Module) -> None:
        start_warp("cpu")
        assert isinstance(network, PolicyNetwork)
        self._in_shape, self._owner = network.in_shape, network.owner
        self._packed = PackedNetwork(network, int(_TOGETHER))
        self._packed.update()
        self._own = threading.local()
        load_kernels(sys.modules[__name__]).result()

    @classmethod
    def try_create(cls, network: nn.Module) -> Self | Reasons:
        """Return the faster forward pass, or the reasons why the kernel does not support it."""
        reasons = unsupported(network)
        return Reasons(reasons) if reasons else cls(network)

    @torch.no_grad()
    def __call__(self, pixels: Tensor) -> Tensor:
        """Observations (N, C, H, W) to logits (N, num_actions); see `PolicyNetwork.forward`."""
        check_shape(pixels, self._in_shape)
        logits = torch.empty(len(pixels), self._packed.num_actions)
        flat = pixels.flatten(1).contiguous()
        arrays = wp.from_torch(flat), self._workspace(), wp.from_torch(logits)
        wp.launch(infer, 1, inputs=[self._packed.layers, *arrays], device="cpu")
        require_finite(logits, self._owner)
        return logits

    def _workspace(self) -> wp.array:
        """Return this thread's workspace."""
        if not hasattr(self._own, "workspace"):
            self._own.workspace = wp.empty(self._packed.workspace_size, dtype=float, device="cpu")
        return self._own.workspace
