"""A network laid out for kernels, see `layers_kernel`."""

from collections.abc import Iterable, Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

from drone_rl.acceleration.layers_kernel import WIDTH, Layers, Product
from drone_rl.policies.networks import PolicyNetwork, Weighted


class PackedLayer(NamedTuple):
    """One layer; a linear one is a convolution whose patch is its whole input."""

    layer: Weighted
    channels: int
    """Of its input; channels beyond them are padding."""
    shape: tuple[int, int, int]
    """Height, width and channels of its input."""
    kernel: tuple[int, int]
    stride: int

    @property
    def is_convolution(self) -> bool:
        """Whether it takes one frame at a time."""
        return isinstance(self.layer, nn.Conv2d)

    @property
    def places(self) -> tuple[int, int]:
        """Rows and columns of outputs."""
        (height, width, _), (high, wide) = self.shape, self.kernel
        return (height - high) // self.stride + 1, (width - wide) // self.stride + 1

    @property
    def num_outs(self) -> int:
        """Outputs of each place, with padding."""
        return -(-len(self.layer.weight) // WIDTH) * WIDTH

    @property
    def num_inputs(self) -> int:
        """Numbers in a patch."""
        return self.kernel[0] * self.kernel[1] * self.shape[2]

    @property
    def has_transpose(self) -> bool:
        """Whether kernels can multiply by the transposed weights."""
        return self.num_inputs % WIDTH == 0

    @property
    def num_made(self) -> int:
        """Outputs for each frame."""
        rows, columns = self.places
        return rows * columns * self.num_outs

    @property
    def geometry(self) -> list[int]:
        """Fields of `Product` from `rows` to `made_down`."""
        _, width, channels = self.shape
        high, wide = self.kernel
        rows, columns = self.places
        across, line = self.stride * channels, width * channels
        is_all = self.kernel == self.shape[:2]
        down = self.num_inputs if is_all else self.stride * line
        patch = [1, self.num_inputs, 0] if is_all else [high, wide * channels, line]
        return [rows * columns, columns, down, across, *patch, self.num_outs, self.num_outs]

    @property
    def parameters(self) -> tuple[Tensor, Tensor]:
        """Weight and bias."""
        return self.layer.get_parameter("weight"), self.layer.get_parameter("bias")

    def order(self, first: int) -> Tensor:
        """Return the index of each packed weight among all parameters; 0 for padding.

        The layer's weights begin at `first`, and its biases follow. Rows are the biases, then the
        inputs. Shape: (1 + num_inputs, num_outs).
        """
        weight, bias = self.parameters
        outs, inner = len(weight), (self.channels, *self.kernel)
        last = first + weight.numel()
        order = torch.zeros(1 + self.num_inputs, self.num_outs, dtype=torch.int32)
        order[0, :outs] = torch.arange(last, last + len(bias))
        by_place = order[1:].view(*self.kernel, self.shape[2], self.num_outs)
        numbers = torch.arange(first, last).view(outs, *inner)
        by_place[:, :, : self.channels, :outs] = numbers.permute(2, 3, 1, 0)
        return order


class Order:
    """Maps parameters to packed weights and back."""

    def __init__(self, layers: Sequence[PackedLayer]) -> None:
        self._layers = layers
        first, there, back = 1, [], []
        for layer in layers:
            order = layer.order(first)
            there.append(in_panels(order))
            unbiased = torch.cat([order.new_zeros(1, layer.num_inputs), order[1:].T])
            back.append(in_panels(unbiased) if layer.has_transpose else order[:0, 0])
            first += sum(parameter.numel() for parameter in layer.parameters)
        self._there, self._back = torch.cat(there), torch.cat(back)
        self._home = torch.empty(first, dtype=torch.int32)
        self._home[self._there.long()] = torch.arange(len(self._there), dtype=torch.int32)
        self.weights_at = list(accumulate(map(len, there), initial=0))
        """Offsets of the layers in the packed weights, and the size of these."""
        self.back_at = list(accumulate(map(len, back), initial=0))
        """The same of the transposed weights."""

    @torch.no_grad()
    def pack(self, weights: Tensor, back: Tensor | None = None) -> None:
        """Write the packed weights, and the transposed ones without biases."""
        parameters = [p.flatten() for layer in self._layers for p in layer.parameters]
        flat = torch.cat([weights.new_zeros(1), *parameters])
        torch.index_select(flat, 0, self._there, out=weights)
        if back is not None:
            torch.index_select(flat, 0, self._back, out=back)

    def unpack(self, gradients: Tensor) -> list[Tensor]:
        """Return the gradient of each weight and bias from that of the packed weights."""
        flat = gradients.index_select(0, self._home[1:])
        parameters = [p for layer in self._layers for p in layer.parameters]
        parts = flat.split([p.numel() for p in parameters])
        return [part.view(p.shape) for part, p in zip(parts, parameters, strict=True)]


def outputs_at(layers: Sequence[PackedLayer]) -> list[int]:
    """Return the offset of each layer in the outputs of a frame, and the size of these."""
    begins = list(accumulate((odd_lines(layer.num_made) for layer in layers), initial=0))
    return [*begins[:-1], odd_lines(begins[-1])]


def odd_lines(size: int) -> int:
    """Round up to an odd number of cache lines, or rows would evict each other from the cache."""
    lines = -(-size // WIDTH)
    return WIDTH * (lines + 1 - lines % 2)


def in_panels(by_row: Tensor) -> Tensor:
    """Return panels of `WIDTH` columns, one after the other, each row by row. Flat."""
    return by_row.view(len(by_row), -1, WIDTH).transpose(0, 1).flatten()


def as_products(rows: Iterable[Iterable[int]]) -> Any:
    """Return an array of `Product`, from the fields of each in order."""
    kind: Any = Product
    fields = np.array([tuple(row) for row in rows], kind.numpy_dtype())
    return wp.array(fields, dtype=kind, device="cpu")


def unsupported(network: nn.Module) -> list[str]:
    """Return why kernels do not support a network; empty if they do.

    They support convolutions of gray frames, then linear layers, with ReLU, in float32 on a CPU.
    """
    name = type(network).__name__
    if not isinstance(network, PolicyNetwork):
        return [f"network {name} is not fused"]
    if network.in_shape[0] != 1:
        return [f"a network of {network.in_shape[0]} channels is not fused"]
    kinds = "".join(_letter(layer) for layer in network.layers)
    convolutions, _, rest = kinds.partition("f")
    is_known = convolutions == "cr" * (len(convolutions) // 2) != "" and (
        rest == "lr" * (len(rest) // 2) + "l"
    )
    if not is_known:
        return [f"network {name} is not fused"]
    tensors = list(network.parameters())
    if not all(p.dtype == torch.float32 and p.device.type == "cpu" for p in tensors):
        return ["a network that is not float32 on the CPU is not fused"]
    return []


def packed_layers(network: nn.Module) -> list[PackedLayer]:
    """Return the layers of a network that is supported."""
    assert isinstance(network, PolicyNetwork)
    channels, height, width = network.in_shape
    padded, packed = channels, []
    for layer in network.layers:
        if isinstance(layer, Weighted):
            is_convolution = isinstance(layer, nn.Conv2d)
            shape = (height, width, padded)
            high, wide = layer.weight.shape[2:] if is_convolution else (height, width)
            stride = int(layer.stride[0]) if is_convolution else 1
            one = PackedLayer(layer, channels, shape, (high, wide), stride)
            packed.append(one)
            (height, width), channels = one.places, len(layer.weight)
            padded = one.num_outs
    return packed


def _letter(layer: nn.Module) -> str:
    if isinstance(layer, nn.Conv2d):
        is_square = layer.stride[0] == layer.stride[1]
        plain = (layer.padding, layer.dilation, layer.groups) == ((0, 0), (1, 1), 1)
        return "c" if is_square and plain and layer.bias is not None else "?"
    if isinstance(layer, nn.Linear):
        return "l" if layer.bias is not None else "?"
    if isinstance(layer, nn.Flatten):
        return "f" if (layer.start_dim, layer.end_dim) == (1, -1) else "?"
    return "r" if isinstance(layer, nn.ReLU) else "?"


class PackedNetwork:
    """A network that kernels support, with its weights laid out for them."""

    def __init__(self, network: nn.Module, num_frames: int) -> None:
        """Pack a network, see `unsupported`, for linear layers of `num_frames` frames at once."""
        packed = packed_layers(network)
        self._order = Order(packed)
        self.weights = torch.zeros(self._order.weights_at[-1])
        """Packed weights."""
        rows, given_at, made_at = [], 0, 0
        for i, (layer, weights_at) in enumerate(zip(packed, self._order.weights_at, strict=False)):
            is_last = i == len(packed) - 1
            rows.append([given_at, weights_at, made_at, *layer.geometry, int(not is_last)])
            is_alone = not is_last and packed[i + 1].is_convolution
            given_at = made_at
            made_at += layer.num_made * (1 if is_alone else num_frames)
        self.workspace_size = made_at
        """Numbers of the buffer that kernels need."""
        layers: Any = Layers()
        layers.products = as_products(rows)
        layers.weights = wp.from_torch(self.weights)
        layers.num_convolutions = sum(layer.is_convolution for layer in packed)
        layers.features_size = packed[layers.num_convolutions].num_inputs
        layers.logits_at, layers.num_outs = given_at, packed[-1].num_outs
        *offsets, self.num_outputs = outputs_at(packed)
        """Numbers of the outputs of all layers of a frame."""
        layers.outputs_at = wp.from_torch(torch.tensor(offsets, dtype=torch.int32))
        self.layers = layers
        """For kernels."""
        self.num_actions = len(packed[-1].layer.weight)

    def update(self) -> None:
        """Pack the present weights."""
        self._order.pack(self.weights)
