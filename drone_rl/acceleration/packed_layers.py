"""A network laid out for kernels, see `layers_kernel`."""

import math
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
    """Of its input, in each plane; channels beyond them are padding."""
    shape: tuple[int, int, int]
    """Height, width and channels of its input, in each plane."""
    kernel: tuple[int, int]
    stride: int
    pool_size: int = 0
    """Side of the squares of outputs whose maximum is kept; 0 without pooling."""
    planes: int = 1
    """Parts of its input that follow each other: the channels of frames."""

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
        return self.planes * self.kernel[0] * self.kernel[1] * self.shape[2]

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
        height, width, channels = self.shape
        high, wide = self.kernel
        rows, columns = self.output_shape
        is_whole, line = self.kernel == self.shape[:2], width * channels
        inputs = self.num_inputs // self.planes
        return {
            "num_patches": rows * columns,
            "patches_per_row": columns,
            "row_stride": inputs if is_whole else self.stride * line,
            "column_stride": self.stride * channels,
            "kernel_rows": 1 if is_whole else high,
            "kernel_row_length": inputs if is_whole else wide * channels,
            "kernel_row_stride": 0 if is_whole else line,
            "num_planes": self.planes,
            "plane_skip": height * line - (0 if is_whole else high * line),
            "num_outs": self.num_outs,
            "output_stride": self.num_outs,
            "pool_size": self.pool_size,
        }

    @property
    def transposed(self) -> dict[str, int]:
        """Geometry from the gradients of outputs to those of patches."""
        return {
            "num_patches": math.prod(self.output_shape),
            "patches_per_row": 1,
            "row_stride": self.num_outs,
            "kernel_rows": 1,
            "kernel_row_length": self.num_outs,
            "num_planes": 1,
            "num_outs": self.num_inputs,
            "output_stride": self.num_inputs,
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
        outs, inner = len(weight), (self.planes, self.channels, *self.kernel)
        last = first + weight.numel()
        order = torch.zeros(1 + self.num_inputs, self.num_outs, dtype=torch.int32)
        order[0, :outs] = torch.arange(last, last + len(bias))
        by_pixel = order[1:].view(self.planes, *self.kernel, self.shape[2], self.num_outs)
        numbers = torch.arange(first, last).view(outs, *inner)
        by_pixel[..., : self.channels, :outs] = numbers.permute(1, 3, 4, 2, 0)
        return order


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


class Reasons(tuple[str, ...]):
    """Reasons why an implementation does not support a configuration."""

    def __str__(self) -> str:
        return "; ".join(self)


_LETTERS = {nn.Conv2d: "c", nn.ReLU: "r", nn.MaxPool2d: "p", nn.Flatten: "f", nn.Linear: "l"}


def unsupported(network: nn.Module) -> list[str]:
    """Return why kernels do not support a network; empty if they do.

    They support convolutions of frames, each with ReLU and possibly pooling, then linear layers
    with ReLU, in float32 on a CPU.
    """
    layers = as_layers(network)
    if isinstance(layers, Unsupported):
        return [layers.reason]
    (branch,) = layers.branches
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
    planes, *size = layers.branches[0].in_shape
    channels, padded, packed = 1, 1, list[PackedLayer]()
    for layer in layers.in_turn:
        if isinstance(layer, nn.MaxPool2d):
            packed[-1] = packed[-1]._replace(pool_size=layer.kernel_size)
        if not isinstance(layer, Weighted):
            continue
        high, wide = packed[-1].pooled_shape if packed else size
        kernel, stride = (high, wide), 1
        if isinstance(layer, nn.Conv2d):
            kernel, stride = (layer.kernel_size[0], layer.kernel_size[1]), layer.stride[0]
        shape = (high, wide, padded)
        packed.append(PackedLayer(layer, channels, shape, kernel, stride, planes=planes))
        channels, padded, planes = len(layer.weight), packed[-1].num_outs, 1
    return packed


class PackedNetwork:
    """A network that kernels support, with its weights laid out for them."""

    def __init__(self, network: nn.Module, first_pixel: int = 0, hidden_pixels: int = 0) -> None:
        """Lay out a network, see `unsupported`; call `pack` for its weights.

        `first_pixel` is the index of the first pixel of a frame that the network sees,
        `hidden_pixels` the number of those in each channel that it does not see.
        """
        layers = self.layers = packed_layers(network)
        first, packed, transposed = 1, list[Tensor](), list[Tensor]()
        for layer in layers:
            order = layer.order(first)
            packed.append(in_panels(order))
            unbiased = torch.cat([order.new_zeros(1, layer.num_inputs), order[1:].T])
            transposed.append(in_panels(unbiased) if layer.has_transpose else order[:0, 0])
            first += sum(parameter.numel() for parameter in layer.parameters)
        self._packed, self._transposed = torch.cat(packed), torch.cat(transposed)
        self._unpacked = torch.empty(first, dtype=torch.int32)
        self._unpacked[self._packed.long()] = torch.arange(len(self._packed), dtype=torch.int32)
        self.weights = torch.zeros(len(self._packed))
        """Packed weights."""
        self.transposed_weights = torch.zeros(len(self._transposed))
        """The same for the backward pass, without biases."""
        self.offsets = OutputOffsets.of(layers)
        self.arrays: Any = Layers()
        """For kernels."""
        geometries = [layer.geometry for layer in layers]
        geometries[0]["input_offset"] = first_pixel
        geometries[0]["plane_skip"] += hidden_pixels
        self.arrays.geometries = _as_geometries(
            {**geometry, "weights_offset": at, "is_rectified": int(layer is not layers[-1])}
            for geometry, layer, at in zip(geometries, layers, _starts(packed), strict=True)
        )
        self.arrays.weights = wp.from_torch(self.weights)
        self.arrays.output_offsets = _as_indices(self.offsets.outputs)
        self.arrays.kept_offsets = _as_indices(self.offsets.kept)
        self.arrays.num_convolutions = sum(layer.is_convolution for layer in layers)
        self.transposed: Any = _as_geometries(
            {**layer.transposed, "weights_offset": at}
            for layer, at in zip(layers, _starts(transposed), strict=True)
        )
        """Geometries of the backward pass, for kernels."""

    @property
    def parameters(self) -> list[Tensor]:
        """Weight and bias of each layer."""
        return [parameter for layer in self.layers for parameter in layer.parameters]

    @torch.no_grad()
    def pack(self) -> None:
        """Write the present weights to `weights` and `transposed_weights`."""
        flat = torch.cat([torch.zeros(1), *(p.flatten() for p in self.parameters)])
        torch.index_select(flat, 0, self._packed, out=self.weights)
        torch.index_select(flat, 0, self._transposed, out=self.transposed_weights)

    def unpack(self, gradients: Tensor) -> list[Tensor]:
        """Return the gradient of each of `parameters` from that of the packed weights."""
        flat = gradients.index_select(0, self._unpacked[1:])
        parts = flat.split([p.numel() for p in self.parameters])
        return [part.view(p.shape) for part, p in zip(parts, self.parameters, strict=True)]


def _starts(parts: Sequence[Tensor]) -> list[int]:
    """Return where each part begins when they are joined."""
    return list(accumulate(map(len, parts), initial=0))[:-1]


def _as_geometries(layers: Iterable[Mapping[str, int]]) -> Any:
    """Return an array of `LayerGeometry` from the fields of each layer; 0 for missing ones."""
    kind: Any = LayerGeometry
    dtype = np.dtype(kind.numpy_dtype())
    rows = [tuple(fields.get(name, 0) for name in dtype.names or ()) for fields in layers]
    return wp.array(np.array(rows, dtype), dtype=kind, device="cpu")


def _as_indices(numbers: Sequence[int]) -> Any:
    """Return an array of int32."""
    return wp.from_torch(torch.tensor(numbers, dtype=torch.int32))
