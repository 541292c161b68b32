"""A network laid out for kernels, see `layers_kernel`."""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

from drone_rl.acceleration.layers_kernel import WIDTH, LayerGeometry, Layers
from drone_rl.policies.layers import Unsupported, as_layers
from drone_rl.policies.networks import Weighted


class PackedLayer(NamedTuple):
    """One layer; a linear one is a convolution whose patch is its whole input."""

    layer: Weighted
    channels: int
    """Of its input; channels beyond them are padding."""
    shape: tuple[int, int, int]
    """Height, width and channels of its input."""
    kernel: tuple[int, int]
    stride: int
    pool_size: int = 0
    """Side of the squares of outputs whose maximum is kept; 0 without pooling."""

    @property
    def is_convolution(self) -> bool:
        """Whether it takes one frame at a time."""
        return isinstance(self.layer, nn.Conv2d)

    @property
    def output_shape(self) -> tuple[int, int]:
        """Rows and columns of outputs."""
        (height, width, _), (high, wide) = self.shape, self.kernel
        return (height - high) // self.stride + 1, (width - wide) // self.stride + 1

    @property
    def num_outs(self) -> int:
        """Outputs of each patch, with padding."""
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
    def output_size(self) -> int:
        """Outputs for each frame, with padding."""
        rows, columns = self.output_shape
        return rows * columns * self.num_outs

    @property
    def pooled_shape(self) -> tuple[int, int]:
        """Rows and columns of outputs that are kept."""
        rows, columns = self.output_shape
        size = self.pool_size or 1
        return rows // size, columns // size

    @property
    def pooled_size(self) -> int:
        """Outputs that are kept for each frame, with padding."""
        rows, columns = self.pooled_shape
        return rows * columns * self.num_outs

    @property
    def geometry(self) -> dict[str, int]:
        """Fields of `LayerGeometry` without offsets and `is_rectified`."""
        _, width, channels = self.shape
        high, wide = self.kernel
        rows, columns = self.output_shape
        is_whole, line = self.kernel == self.shape[:2], width * channels
        return {
            "num_patches": rows * columns,
            "patches_per_row": columns,
            "row_stride": self.num_inputs if is_whole else self.stride * line,
            "column_stride": self.stride * channels,
            "kernel_rows": 1 if is_whole else high,
            "kernel_row_length": self.num_inputs if is_whole else wide * channels,
            "kernel_row_stride": 0 if is_whole else line,
            "num_outs": self.num_outs,
            "output_stride": self.num_outs,
            "pool_size": self.pool_size,
        }

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
        by_pixel = order[1:].view(*self.kernel, self.shape[2], self.num_outs)
        numbers = torch.arange(first, last).view(outs, *inner)
        by_pixel[:, :, : self.channels, :outs] = numbers.permute(2, 3, 1, 0)
        return order


class Order:
    """Maps parameters to packed weights and back."""

    def __init__(self, layers: Sequence[PackedLayer]) -> None:
        self._layers = layers
        first, packed, transposed = 1, [], []
        for layer in layers:
            order = layer.order(first)
            packed.append(in_panels(order))
            unbiased = torch.cat([order.new_zeros(1, layer.num_inputs), order[1:].T])
            transposed.append(in_panels(unbiased) if layer.has_transpose else order[:0, 0])
            first += sum(parameter.numel() for parameter in layer.parameters)
        self._packed, self._transposed = torch.cat(packed), torch.cat(transposed)
        self._unpacked = torch.empty(first, dtype=torch.int32)
        self._unpacked[self._packed.long()] = torch.arange(len(self._packed), dtype=torch.int32)
        self.weight_offsets = list(accumulate(map(len, packed), initial=0))
        """Offsets of the layers in the packed weights, and the size of these."""
        self.transposed_offsets = list(accumulate(map(len, transposed), initial=0))
        """The same of the transposed weights."""

    @torch.no_grad()
    def pack(self, weights: Tensor, transposed: Tensor | None = None) -> None:
        """Write the packed weights, and the transposed ones without biases."""
        parameters = [p.flatten() for layer in self._layers for p in layer.parameters]
        flat = torch.cat([weights.new_zeros(1), *parameters])
        torch.index_select(flat, 0, self._packed, out=weights)
        if transposed is not None:
            torch.index_select(flat, 0, self._transposed, out=transposed)

    def unpack(self, gradients: Tensor) -> list[Tensor]:
        """Return the gradient of each weight and bias from that of the packed weights."""
        flat = gradients.index_select(0, self._unpacked[1:])
        parameters = [p for layer in self._layers for p in layer.parameters]
        parts = flat.split([p.numel() for p in parameters])
        return [part.view(p.shape) for part, p in zip(parts, parameters, strict=True)]


class OutputOffsets(NamedTuple):
    """Where the outputs of each layer are among those of a frame."""

    outputs: list[int]
    """Offset of each layer's outputs before pooling; last, the size of the outputs of a frame."""
    kept: list[int]
    """Offset of each layer's outputs after pooling: the inputs of the next layer."""

    @classmethod
    def of(cls, layers: Sequence[PackedLayer]) -> "OutputOffsets":
        """Lay out the outputs of layers."""
        every, kept, end = [], [], 0
        for layer in layers:
            every.append(end)
            end += odd_lines(layer.output_size)
            kept.append(end if layer.pool_size else every[-1])
            end += odd_lines(layer.pooled_size) if layer.pool_size else 0
        return cls([*every, odd_lines(end)], kept)


def odd_lines(size: int) -> int:
    """Round up to an odd number of cache lines, or rows would evict each other from the cache."""
    lines = -(-size // WIDTH)
    return WIDTH * (lines + 1 - lines % 2)


def in_panels(by_row: Tensor) -> Tensor:
    """Return panels of `WIDTH` columns, one after the other, each row by row. Flat."""
    return by_row.view(len(by_row), -1, WIDTH).transpose(0, 1).flatten()


def as_geometries(layers: Iterable[Mapping[str, int]]) -> Any:
    """Return an array of `LayerGeometry` from the fields of each layer; 0 for missing ones."""
    kind: Any = LayerGeometry
    dtype = np.dtype(kind.numpy_dtype())
    rows = [tuple(fields.get(name, 0) for name in dtype.names or ()) for fields in layers]
    return wp.array(np.array(rows, dtype), dtype=kind, device="cpu")


def as_indices(numbers: Sequence[int]) -> Any:
    """Return an array of int32."""
    return wp.from_torch(torch.tensor(numbers, dtype=torch.int32))


class Reasons(tuple[str, ...]):
    """Reasons why an implementation does not support a configuration."""

    def __str__(self) -> str:
        return "; ".join(self)


def unsupported(network: nn.Module) -> list[str]:
    """Return why kernels do not support a network; empty if they do.

    They support convolutions of gray frames, each with ReLU and possibly pooling, then linear
    layers with ReLU, in float32 on a CPU.
    """
    layers = as_layers(network)
    if isinstance(layers, Unsupported):
        return [layers.reason]
    (branch,) = layers.branches
    if branch.in_shape[0] != 1:
        return [f"a network of {branch.in_shape[0]} channels is not fused"]
    kinds = "".join(_LETTERS[type(layer)] for layer in layers.in_turn)
    strides = [layer.stride for layer in branch.layers if isinstance(layer, nn.Conv2d)]
    if not re.fullmatch("(crp?)+f(lr)*l", kinds) or any(high != wide for high, wide in strides):
        return [f"network {type(network).__name__} is not fused"]
    tensors = list(network.parameters())
    if not all(p.dtype == torch.float32 and p.device.type == "cpu" for p in tensors):
        return ["a network that is not float32 on the CPU is not fused"]
    return []


def packed_layers(network: nn.Module) -> list[PackedLayer]:
    """Return the layers of a network that is supported."""
    layers = as_layers(network)
    assert not isinstance(layers, Unsupported)
    channels, *size = layers.branches[0].in_shape
    padded, packed = channels, list[PackedLayer]()
    for layer in layers.in_turn:
        if isinstance(layer, nn.MaxPool2d):
            packed[-1] = packed[-1]._replace(pool_size=layer.kernel_size)
        if not isinstance(layer, Weighted):
            continue
        high, wide = packed[-1].pooled_shape if packed else size
        kernel, stride = (high, wide), 1
        if isinstance(layer, nn.Conv2d):
            kernel, stride = (layer.kernel_size[0], layer.kernel_size[1]), layer.stride[0]
        packed.append(PackedLayer(layer, channels, (high, wide, padded), kernel, stride))
        channels, padded = len(layer.weight), packed[-1].num_outs
    return packed


_LETTERS = {nn.Conv2d: "c", nn.ReLU: "r", nn.MaxPool2d: "p", nn.Flatten: "f", nn.Linear: "l"}


class PackedNetwork:
    """A network that kernels support, with its weights laid out for them."""

    def __init__(self, network: nn.Module, num_frames: int, first_pixel: int = 0) -> None:
        """Pack a network, see `unsupported`.

        Args:
            network: The network.
            num_frames: Frames whose linear layers are computed at once.
            first_pixel: Index of the first pixel of a frame that the network sees.
        """
        packed = packed_layers(network)
        self._order = Order(packed)
        self.weights = torch.zeros(self._order.weight_offsets[-1])
        """Packed weights."""
        geometries, inputs, outputs = [], first_pixel, 0
        for i, (layer, weights) in enumerate(zip(packed, self._order.weight_offsets, strict=False)):
            is_last = i == len(packed) - 1
            offsets = {"input_offset": inputs, "weights_offset": weights, "output_offset": outputs}
            geometries.append({**offsets, **layer.geometry, "is_rectified": int(not is_last)})
            if layer.pool_size:
                outputs += layer.output_size
                geometries[-1]["pooled_offset"] = outputs
            is_alone = not is_last and packed[i + 1].is_convolution
            inputs = outputs
            outputs += layer.pooled_size * (1 if is_alone else num_frames)
        self.workspace_size = outputs
        """Numbers of the buffer that kernels need."""
        layers: Any = Layers()
        layers.geometries = as_geometries(geometries)
        layers.weights = wp.from_torch(self.weights)
        layers.num_convolutions = sum(layer.is_convolution for layer in packed)
        layers.features_size = packed[layers.num_convolutions].num_inputs
        layers.logits_offset, layers.logits_stride = inputs, packed[-1].num_outs
        offsets = OutputOffsets.of(packed)
        self.num_activations = offsets.outputs[-1]
        """Numbers of the outputs of all layers of a frame."""
        layers.output_offsets = as_indices(offsets.outputs)
        layers.kept_offsets = as_indices(offsets.kept)
        self.layers = layers
        """For kernels."""

    def update(self) -> None:
        """Pack the present weights."""
        self._order.pack(self.weights)
