"""A network laid out for kernels, see `layers_kernel`."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate, repeat
from typing import Any, NamedTuple

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

from drone_rl.acceleration.layers_kernel import WIDTH, LayerGeometry, Layers
from drone_rl.policies.layers import Unsupported, as_layers
from drone_rl.policies.networks import Weighted


class Part(NamedTuple):
    """Numbers of a patch: rows of pixels, channels last, plane after plane."""

    planes: int
    """Parts that follow each other: the channels of frames."""
    high: int
    wide: int
    channels: int
    """In each plane."""
    padded: int
    """The same with padding."""


class PackedLayer(NamedTuple):
    """One layer; a linear one is a convolution whose patch is its whole input."""

    modules: tuple[Weighted, ...]
    """What computes its outputs, side by side: one layer, or the last one and a critic's."""
    parts: tuple[Part, ...]
    """Of a patch: one, or the features of each branch."""
    shape: tuple[int, int, int]
    """Height, width and channels of its input, in each plane, with padding."""
    source: int
    """Number of the layer whose outputs are its input; -1 for the observation.

    For the first layer of the trunk, that of the first branch, which others follow.
    """
    ends_branch: bool = False
    """Whether its outputs are features, the inputs of the first layer of the trunk."""
    kernel: tuple[int, int] = (1, 1)
    """Rows and columns of a patch, of numbers as in `shape`."""
    stride: int = 1
    pool_size: int = 0
    """Side of the squares of outputs whose maximum is kept; 0 without pooling."""

    @property
    def planes(self) -> int:
        """See `Part`."""
        return self.parts[0].planes

    @property
    def output_shape(self) -> tuple[int, int]:
        """Rows and columns of outputs."""
        (height, width, _), (high, wide) = self.shape, self.kernel
        return (height - high) // self.stride + 1, (width - wide) // self.stride + 1

    @property
    def num_outs(self) -> int:
        """Outputs of each patch, with padding."""
        return -(-sum(len(module.weight) for module in self.modules) // WIDTH) * WIDTH

    @property
    def num_inputs(self) -> int:
        """Numbers in a patch."""
        return sum(part.planes * part.high * part.wide * part.padded for part in self.parts)

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
    def parameters(self) -> list[Tensor]:
        """Weight and bias of each module."""
        return [m.get_parameter(name) for m in self.modules for name in ("weight", "bias")]

    def order(self, first: int) -> Tensor:
        """Return the index of each packed weight among all parameters; 0 for padding.

        The layer's parameters begin at `first`. Rows are the biases, then the inputs. Shape:
        (1 + num_inputs, num_outs).
        """
        order = torch.zeros(1 + self.num_inputs, self.num_outs, dtype=torch.int32)
        column = 0
        for module in self.modules:
            outs, count, row = len(module.weight), module.weight.numel(), 1
            columns = slice(column, column + outs)
            numbers = torch.arange(first, first + count).view(outs, -1)
            order[0, columns] = torch.arange(first + count, first + count + outs)
            for planes, high, wide, channels, padded in self.parts:
                size, rows = planes * channels * high * wide, planes * high * wide * padded
                by_pixel = order[row : row + rows].view(planes, high, wide, padded, -1)
                inner = numbers[:, :size].reshape(outs, planes, channels, high, wide)
                by_pixel[..., :channels, columns] = inner.permute(1, 3, 4, 2, 0)
                numbers, row = numbers[:, size:], row + rows
            first, column = first + count + outs, column + outs
        return order


class OutputOffsets(NamedTuple):
    """Where the outputs of each layer are among those of a frame."""

    outputs: list[int]
    """Offset of each layer's outputs before pooling; last, the size of the outputs of a frame."""
    kept: list[int]
    """Offset of each layer's outputs after pooling: the inputs of the next layer."""
    starts: list[int]
    """The same; of the branches' last layers that of the first one, which the others follow."""
    strides: list[int]
    """Numbers of the outputs from `starts` on."""

    @classmethod
    def of(cls, layers: Sequence[PackedLayer]) -> "OutputOffsets":
        """Lay out the outputs of layers."""
        every, kept, starts, strides = ([0] * len(layers) for _ in range(4))
        ends, end = [i for i, layer in enumerate(layers) if layer.ends_branch], 0
        for i, layer in enumerate(layers):
            if i == ends[-1] + 1:  # all outputs of branches are before their features
                start, end = end, end + odd_lines(sum(layers[k].pooled_size for k in ends))
                at = start
                for k in ends:
                    kept[k], starts[k], strides[k] = at, start, end - start
                    every[k] = every[k] if layers[k].pool_size else at
                    at += layers[k].pooled_size
            if layer.pool_size or not layer.ends_branch:
                every[i] = kept[i] = end
                end += odd_lines(layer.output_size)
            if not layer.ends_branch:
                strides[i] = odd_lines(layer.pooled_size)
                if layer.pool_size:
                    kept[i], end = end, end + strides[i]
                starts[i] = kept[i]
        return cls([*every, odd_lines(end)], kept, starts, strides)


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

    They support convolutions of frames, each with ReLU and possibly pooling, a linear layer with
    ReLU of vectors, then linear layers with ReLU, in float32 on a CPU.
    """
    layers = as_layers(network, several=True)
    if isinstance(layers, Unsupported):
        return [layers.reason]
    branches = [branch.layers for branch in layers.branches]
    kinds = ["".join(_LETTERS[type(layer)] for layer in part) for part in (*branches, layers.trunk)]
    strides = [layer.stride for part in branches for layer in part if isinstance(layer, nn.Conv2d)]
    are_known = all(re.fullmatch("(crp?)+f|lr", kind) for kind in kinds[:-1])
    are_known &= all(high == wide for high, wide in strides)
    if not are_known or not re.fullmatch("(lr)*l", kinds[-1]):
        return [f"network {type(network).__name__} is not fused"]
    tensors = list(network.parameters())
    if not all(p.dtype == torch.float32 and p.device.type == "cpu" for p in tensors):
        return ["a network that is not float32 on the CPU is not fused"]
    return []


def packed_layers(network: nn.Module, critic: nn.Linear | None = None) -> list[PackedLayer]:
    """Return the layers of a network that is supported, with a critic next to the last one."""
    layers = as_layers(network, several=True)
    assert not isinstance(layers, Unsupported)
    packed, features = list[PackedLayer](), list[Part]()
    for branch in layers.branches:
        is_image = len(branch.in_shape) > 1
        planes, size = (branch.in_shape[0], branch.in_shape[1:]) if is_image else (1, (1, 1))
        channels = padded = 1 if is_image else branch.in_shape[0]
        source = -1
        for layer in branch.layers:
            if isinstance(layer, nn.MaxPool2d):
                packed[-1] = packed[-1]._replace(pool_size=layer.kernel_size)
                size = packed[-1].pooled_shape
            if not isinstance(layer, Weighted):
                continue
            high, wide = size
            kernel, stride = (1, 1), 1
            if isinstance(layer, nn.Conv2d):
                kernel, stride = (layer.kernel_size[0], layer.kernel_size[1]), layer.stride[0]
            parts = (Part(planes, *kernel, channels, padded),)
            shape = (high, wide, padded)
            packed.append(PackedLayer((layer,), parts, shape, source, kernel=kernel, stride=stride))
            size, planes, source = packed[-1].output_shape, 1, len(packed) - 1
            channels, padded = len(layer.weight), packed[-1].num_outs
        packed[-1] = packed[-1]._replace(ends_branch=True)
        features.append(Part(1, size[0], size[1], channels, padded))
    source = next(i for i, layer in enumerate(packed) if layer.ends_branch)
    parts = tuple(features)
    for layer in layers.trunk:
        if isinstance(layer, Weighted):
            extra = (critic,) if critic is not None and layer is layers.trunk[-1] else ()
            width = sum(part.high * part.wide * part.padded for part in parts)
            packed.append(PackedLayer((layer, *extra), parts, (1, 1, width), source))
            source = len(packed) - 1
            parts = (Part(1, 1, 1, len(layer.weight), packed[-1].num_outs),)
    return packed


def branch_sizes(network: nn.Module) -> list[int]:
    """Return how many numbers each branch of a network that is supported sees."""
    layers = as_layers(network, several=True)
    assert not isinstance(layers, Unsupported)
    return [math.prod(branch.in_shape) for branch in layers.branches]


class PackedNetwork:
    """A network that kernels support, with its weights laid out for them."""

    def __init__(
        self,
        network: nn.Module,
        places: Iterable[tuple[int, int]] | None = None,
        critic: nn.Linear | None = None,
    ) -> None:
        """Lay out a network, see `unsupported`; call `pack` for its weights.

        Args:
            network: The network.
            places: Of the input of each branch, where the network's numbers begin in the row of an
                observation, and how many of each channel it does not see; by default they follow
                each other without gaps.
            critic: A layer that takes the same features as the last one.
        """
        layers = self.layers = packed_layers(network, critic)
        places = zip(starts(branch_sizes(network)), repeat(0)) if places is None else places
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
        firsts = [g for g, layer in zip(geometries, layers, strict=True) if layer.source < 0]
        for geometry, (first_number, hidden) in zip(firsts, places, strict=False):
            geometry["input_offset"] = first_number
            geometry["plane_skip"] += hidden
        self.arrays.geometries = _as_geometries(
            {**geometry, "weights_offset": at, "is_rectified": int(layer is not layers[-1])}
            for geometry, layer, at in zip(
                geometries, layers, starts(map(len, packed)), strict=True
            )
        )
        self.arrays.weights = wp.from_torch(self.weights)
        self.arrays.output_offsets = _as_indices(self.offsets.outputs)
        self.arrays.kept_offsets = _as_indices(self.offsets.kept)
        self.arrays.starts = _as_indices(self.offsets.starts)
        self.arrays.strides = _as_indices(self.offsets.strides)
        self.arrays.sources = _as_indices([layer.source for layer in layers])
        self.arrays.num_branch_layers = max(i for i, la in enumerate(layers) if la.ends_branch) + 1
        self.transposed: Any = _as_geometries(
            {**layer.transposed, "weights_offset": at}
            for layer, at in zip(layers, starts(map(len, transposed)), strict=True)
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


def starts(sizes: Iterable[int]) -> list[int]:
    """Return where each part begins when parts of some sizes are joined."""
    return list(accumulate(sizes, initial=0))[:-1]


def _as_geometries(layers: Iterable[Mapping[str, int]]) -> Any:
    """Return an array of `LayerGeometry` from the fields of each layer; 0 for missing ones."""
    kind: Any = LayerGeometry
    dtype = np.dtype(kind.numpy_dtype())
    rows = [tuple(fields.get(name, 0) for name in dtype.names or ()) for fields in layers]
    return wp.array(np.array(rows, dtype), dtype=kind, device="cpu")


def _as_indices(numbers: Sequence[int]) -> Any:
    """Return an array of int32."""
    return wp.from_torch(torch.tensor(numbers, dtype=torch.int32))
