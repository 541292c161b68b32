# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""A network laid out for kernels, see `layers_kernel`."""

from typing import NamedTuple, Self

import torch
import warp as wp
from torch import Tensor, nn

from drone_rl.policies.cnn import PolicyNetwork, Weighted
from drone_rl.policies.layers_kernel import WIDTH, Layers


class _Packing(NamedTuple):
    """One layer; a linear one is a convolution that takes in all there is."""

    layer: Weighted
    channels: int
    """Of its input; those after them are 0."""
    shape: tuple[int, int, int]
    """Height, width and channels of its input."""
    kernel: tuple[int, int]
    stride: int

    @property
    def places(self) -> tuple[int, int]:
        """Rows and columns of outputs."""
        (height, width, _), (high, wide) = self.shape, self.kernel
        return (height - high) // self.stride + 1, (width - wide) // self.stride + 1

    @property
    def num_outs(self) -> int:
        return -(-len(self.layer.weight) // WIDTH) * WIDTH

    @property
    def num_inputs(self) -> int:
        """Numbers that an output is a sum of."""
        return self.kernel[0] * self.kernel[1] * self.shape[2]

    @property
    def size(self) -> int:
        """Of its weights."""
        return (1 + self.num_inputs) * self.num_outs

    def steps(self, given_at: int, made_at: int, weights_at: int, is_rectified: bool) -> list[int]:
        """See `Layers.steps`."""
        _, width, channels = self.shape
        high, wide = self.kernel
        rows, columns = self.places
        across, line = self.stride * channels, width * channels
        is_all = self.kernel == self.shape[:2]
        down = self.num_inputs if is_all else self.stride * line
        patch = [1, self.num_inputs, 0] if is_all else [high, wide * channels, line]
        outs = [self.num_outs, int(is_rectified)]
        return [given_at, made_at, weights_at, rows * columns, columns, down, across, *patch, *outs]

    def pack(self, weights: Tensor) -> None:
        """Writes them, biases first. Shape: (size,)."""
        outs, inner = len(self.layer.weight), (self.channels, *self.kernel)
        by_row = weights.view(1 + self.num_inputs, self.num_outs)
        by_row[0, :outs].copy_(self.layer.get_parameter("bias"))
        by_place = by_row[1:].view(*self.kernel, self.shape[2], self.num_outs)
        weight = self.layer.weight.reshape(outs, *inner).permute(2, 3, 1, 0)
        by_place[:, :, : self.channels, :outs] = weight


class PackedNetwork:
    """Convolutions of gray pictures, then linear layers, rectified in between."""

    def __init__(self, network: PolicyNetwork, num_pictures: int) -> None:
        """Lays it out; `find` tells whether that can be done.

        Args:
            network: The policy's.
            num_pictures: That are decided on together.
        """
        self._packings = _packings(network)
        sizes = [packing.size for packing in self._packings]
        weights = torch.zeros(sum(sizes))
        self._weights = weights.split(sizes)
        steps, self.room = self._lay_out(sizes, num_pictures)
        made = Layers()
        made.steps = wp.from_torch(torch.tensor(steps, dtype=torch.int32))
        made.weights = wp.from_torch(weights)
        made.num_convolutions = sum(isinstance(p.layer, nn.Conv2d) for p in self._packings)
        made.picture_size = self._packings[made.num_convolutions].num_inputs
        made.logits_at, made.num_outs = steps[-1][1], self._packings[-1].num_outs
        self.layers = made
        """For kernels."""
        self.num_actions = len(self._packings[-1].layer.weight)

    @classmethod
    def find(cls, network: nn.Module, num_pictures: int) -> Self | None:
        """The network, if it is of such layers and on the CPU."""
        if not (isinstance(network, PolicyNetwork) and network.in_shape[0] == 1):
            return None
        kinds = "".join(_letter(layer) for layer in network.layers)
        convolutions, _, rest = kinds.partition("f")
        is_known = convolutions == "cr" * (len(convolutions) // 2) != "" and (
            rest == "lr" * (len(rest) // 2) + "l"
        )
        tensors = list(network.parameters())
        is_plain = all(p.dtype == torch.float32 and p.device.type == "cpu" for p in tensors)
        return cls(network, num_pictures) if is_known and is_plain else None

    @torch.no_grad()
    def update(self) -> None:
        """Takes over what the network has learned."""
        for packing, weights in zip(self._packings, self._weights, strict=True):
            packing.pack(weights)

    def _lay_out(self, sizes: list[int], num_pictures: int) -> tuple[list[list[int]], int]:
        """Steps of the layers, and the numbers that the room to work must hold."""
        steps, given_at, weights_at, room = [], 0, 0, 0
        for i, (packing, size) in enumerate(zip(self._packings, sizes, strict=True)):
            is_last = i == len(self._packings) - 1
            steps.append(packing.steps(given_at, room, weights_at, not is_last))
            is_alone = not is_last and isinstance(self._packings[i + 1].layer, nn.Conv2d)
            rows, columns = packing.places
            given_at, weights_at = room, weights_at + size
            room += rows * columns * packing.num_outs * (1 if is_alone else num_pictures)
        return steps, room


def _packings(network: PolicyNetwork) -> list[_Packing]:
    channels, height, width = network.in_shape
    padded, packings = channels, []
    for layer in network.layers:
        if isinstance(layer, Weighted):
            is_convolution = isinstance(layer, nn.Conv2d)
            shape = (height, width, padded)
            high, wide = layer.weight.shape[2:] if is_convolution else (height, width)
            stride = int(layer.stride[0]) if is_convolution else 1
            packing = _Packing(layer, channels, shape, (high, wide), stride)
            packings.append(packing)
            (height, width), channels = packing.places, len(layer.weight)
            padded = packing.num_outs
    return packings


def _letter(layer: nn.Module) -> str:
    """What stands for a kind of layer."""
    if isinstance(layer, nn.Conv2d):
        is_square = layer.stride[0] == layer.stride[1]
        plain = (layer.padding, layer.dilation, layer.groups) == ((0, 0), (1, 1), 1)
        return "c" if is_square and plain and layer.bias is not None else "?"
    if isinstance(layer, nn.Linear):
        return "l" if layer.bias is not None else "?"
    if isinstance(layer, nn.Flatten):
        return "f" if (layer.start_dim, layer.end_dim) == (1, -1) else "?"
    return "r" if isinstance(layer, nn.ReLU) else "?"
