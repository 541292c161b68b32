# pyright: reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# (Warp compiles the kernel; Python's types say nothing about it.)
"""A small network asked about many pictures on one core, in half of torch's time."""

import sys
import threading

import torch
import warp as wp
from torch import Tensor, nn

from drone_rl.policies.finite import require_finite
from drone_rl.policies.layers_kernel import Layers, decide, look
from drone_rl.policies.packing import PackedNetwork
from drone_rl.sim.rendering.devices import load_kernels, start_warp

_TOGETHER = wp.constant(16)
"""Pictures whose linear layers are worked out together."""

wp.set_module_options({"enable_backward": False})


@wp.kernel
def answer(
    layers: Layers, pictures: wp.array2d[float], room: wp.array[float], logits: wp.array2d[float]
) -> None:
    """Works logits out; launch it with a dimension of 1.

    Args:
        layers: The network.
        pictures: A row each.
        room: To work in.
        logits: Are written, a row a picture.
    """
    for first in range(0, pictures.shape[0], _TOGETHER):
        count = wp.min(pictures.shape[0] - first, _TOGETHER)
        for row in range(count):
            look(layers, pictures[first + row], room, row)
        decide(layers, room, count)
        for row in range(count):
            at = layers.logits_at + row * layers.num_outs
            for action in range(logits.shape[1]):
                logits[first + row, action] = room[at + action]


class Answers:
    """Logits of a network that learns no more; any number of threads may ask at a time."""

    def __init__(self, network: nn.Module) -> None:
        """Packs the network, if it is of layers that kernels know; else torch is asked."""
        start_warp("cpu")
        self._network = network
        self._packed = PackedNetwork.find(network, int(_TOGETHER))
        self._own = threading.local()
        if self._packed is not None:
            self._packed.update()
            load_kernels(sys.modules[__name__]).result()

    @torch.no_grad()
    def __call__(self, pictures: Tensor) -> Tensor:
        """Pictures (N, C, H, W) to logits (N, num_actions)."""
        if self._packed is None:
            return self._network(pictures)
        logits = torch.empty(len(pictures), self._packed.num_actions)
        given = pictures.flatten(1).contiguous()
        arrays = wp.from_torch(given), self._room(), wp.from_torch(logits)
        wp.launch(answer, 1, inputs=[self._packed.layers, *arrays], device="cpu")
        require_finite(logits, getattr(self._network, "owner", "the policy"))
        return logits

    def _room(self) -> wp.array:
        """A thread's own."""
        if not hasattr(self._own, "room"):
            assert self._packed is not None
            self._own.room = wp.empty(self._packed.room, dtype=float, device="cpu")
        return self._own.room
