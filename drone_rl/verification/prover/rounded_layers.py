"""Rounding errors of single layers, see `drone_rl.verification.prover.rounding`.

Errors are bounds, in float64, on the difference between any float32 result and the exact one.
"""

import abc
import dataclasses

import torch
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.policies.layers import Layer

UNIT = 2.0**-24
"""Unit roundoff of float32: the largest relative error of one operation."""
TINY = 2.0**-126
"""Smallest normal number of float32; an operation may flush smaller numbers to 0."""
LARGEST = float(torch.finfo(torch.float32).max)
SLACK = 1.001
"""Factor for the rounding of the bounds' own arithmetic in float64."""


@dataclasses.dataclass(frozen=True)
class Note:
    """Values of the forward pass that a layer saves for the backward pass."""

    shape: torch.Size
    """Shape of the input."""
    local: Tensor | None = None
    """Errors of the outputs that are not proportional to errors of the inputs. Shape: output's."""
    mask: Tensor | None = None
    """Where gradients pass from the output to the input."""


class RoundedLayer(abc.ABC):
    """A layer with bounds on its rounding errors."""

    @abc.abstractmethod
    def __call__(self, value: Tensor) -> Tensor:
        """Evaluate the layer in float32."""

    @abc.abstractmethod
    def bound(self, value: Tensor, error: Tensor) -> Tensor:
        """Return bounds on the errors of outputs that hold for all inputs. Shape: (1, *), float64.

        `value` are the inputs in float32, (N, *), and `error` bounds their errors, (1, *).
        """

    @abc.abstractmethod
    def run(self, value: Tensor, error: Tensor) -> tuple[Tensor, Tensor, Note]:
        """Return exact outputs, their errors and a note, given inputs and their errors.

        Shapes: (N, *), float64.
        """

    @abc.abstractmethod
    def back(self, slope: Tensor, note: Note) -> Tensor:
        """Return gradients by the inputs, given gradients by the outputs. Shapes: (N, P, *)."""


class _Affine(RoundedLayer):
    """A convolution without padding or a linear layer, with a bias."""

    def __init__(self, layer: nn.Conv2d | nn.Linear) -> None:
        weight, bias = (layer.get_parameter(name).detach() for name in ("weight", "bias"))
        self._single = weight, bias
        self._weight, self._bias = weight.double(), bias.double()
        self._size, self._ones = self._weight.abs(), torch.ones_like(self._weight[:1])
        self._stride = layer.stride if isinstance(layer, nn.Conv2d) else None
        self._terms = weight[0].numel() + 1

    def __call__(self, value: Tensor) -> Tensor:
        return self._apply(value, *self._single)

    def bound(self, value: Tensor, error: Tensor) -> Tensor:
        size = largest_of(value) + 2 * error  # covers exact inputs and those of any evaluation
        total = self._apply(size, self._size, self._bias.abs())
        carried = self._apply(error, self._size, None)
        return SLACK * carried + self._local(total, total, size)

    def run(self, value: Tensor, error: Tensor) -> tuple[Tensor, Tensor, Note]:
        size = value.abs() + error
        total = self._apply(size, self._size, self._bias.abs())
        carried = self._apply(error, self._size, None)
        made = self._apply(value, self._weight, self._bias)
        # no partial sum exceeds the sum of all positive terms or of all negative terms
        most = torch.minimum(total, 0.5 * (total + made.abs() + carried))
        local = self._local(total, most, size)
        return made, SLACK * carried + local, Note(value.shape, local)

    def back(self, slope: Tensor, note: Note) -> Tensor:
        if self._stride is None:
            return slope @ self._weight
        flat = slope.flatten(0, 1)
        gradients = functional.conv_transpose2d(flat, self._weight, stride=self._stride)
        rows, columns = (a - b for a, b in zip(note.shape[-2:], gradients.shape[-2:], strict=True))
        gradients = functional.pad(gradients, (0, columns, 0, rows))  # pixels that no patch reaches
        return gradients.view(*slope.shape[:2], *note.shape[1:])

    def _apply(self, value: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
        if self._stride is None:
            return functional.linear(value, weight, bias)
        return functional.conv2d(value, weight, bias, stride=self._stride)

    def _local(self, total: Tensor, most: Tensor, size: Tensor) -> Tensor:
        """Return the rounding errors of sums.

        `total` bounds the sum of absolute terms, `most` partial sums, and `size` the inputs.
        """
        roundings = SLACK / (1 - self._terms * UNIT)
        rounded = roundings * UNIT * (self._terms * most + 2 * total)
        # weights, inputs, products and sums that are too small to be normal
        inputs = self._apply(size, self._ones, None)  # the same of each output
        weights = self._size.flatten(1).sum(-1).view(-1, *[1] * (total.ndim - 2))
        lost = 2 * TINY * (inputs + weights + 4 * self._terms)
        return (rounded + lost).masked_fill(~(SLACK * total < LARGEST), torch.inf)


class _Rectified(RoundedLayer):
    """A ReLU."""

    def __call__(self, value: Tensor) -> Tensor:
        return value.clamp(min=0)

    def bound(self, value: Tensor, error: Tensor) -> Tensor:
        return error

    def run(self, value: Tensor, error: Tensor) -> tuple[Tensor, Tensor, Note]:
        is_on, is_off = value > error, value < -error
        error = error.masked_fill(is_off, 0.0)
        return value.clamp(min=0), error, Note(value.shape, error.masked_fill(is_on, 0.0), is_on)

    def back(self, slope: Tensor, note: Note) -> Tensor:
        assert note.mask is not None
        return slope.where(note.mask[:, None], 0.0)


class _Flat(RoundedLayer):
    """A flatten layer."""

    def __call__(self, value: Tensor) -> Tensor:
        return value.flatten(1)

    def bound(self, value: Tensor, error: Tensor) -> Tensor:
        return error.flatten(1)

    def run(self, value: Tensor, error: Tensor) -> tuple[Tensor, Tensor, Note]:
        return value.flatten(1), error.flatten(1), Note(value.shape)

    def back(self, slope: Tensor, note: Note) -> Tensor:
        return slope.view(*slope.shape[:2], *note.shape[1:])


class _Maximum(RoundedLayer):
    """Max pooling over squares that do not overlap."""

    def __init__(self, side: int) -> None:
        self._side = side

    def __call__(self, value: Tensor) -> Tensor:
        return functional.max_pool2d(value, self._side)

    def bound(self, value: Tensor, error: Tensor) -> Tensor:
        return functional.max_pool2d(error, self._side)

    def run(self, value: Tensor, error: Tensor) -> tuple[Tensor, Tensor, Note]:
        made, index = functional.max_pool2d(value, self._side, return_indices=True)
        most = functional.max_pool2d(error, self._side)
        index = index.flatten(2)
        upper = (value + error).flatten(2).scatter(2, index, -torch.inf).view_as(value)
        others = functional.max_pool2d(upper, self._side)
        lower = made - error.flatten(2).gather(2, index).view_as(made)
        is_clear = lower >= others
        winner = torch.zeros_like(value, dtype=torch.bool).flatten(2)
        winner = winner.scatter(2, index, is_clear.flatten(2)).view_as(value)
        return made, most, Note(value.shape, most.masked_fill(is_clear, 0.0), winner)

    def back(self, slope: Tensor, note: Note) -> Tensor:
        assert note.mask is not None
        rows, columns = note.shape[-2:]
        wide = slope.repeat_interleave(self._side, -1).repeat_interleave(self._side, -2)
        missing = (0, columns - wide.shape[-1], 0, rows - wide.shape[-2])
        return functional.pad(wide, missing).where(note.mask[:, None], 0.0)


def largest_of(value: Tensor) -> Tensor:
    """Return the largest absolute values in a batch (N, *). Shape: (1, *), float64."""
    value = value.contiguous()  # a convolution's outputs may not be, which takes 50 times as long
    return torch.maximum(value.amax(0, keepdim=True), -value.amin(0, keepdim=True)).double()


def rounded(layer: Layer) -> RoundedLayer:
    """Return the rounding errors of a layer, see `drone_rl.policies.layers.as_layers`."""
    match layer:
        case nn.MaxPool2d(kernel_size=int(side)):
            return _Maximum(side)
        case nn.ReLU():
            return _Rectified()
        case nn.Conv2d() | nn.Linear():
            return _Affine(layer)
    return _Flat()
