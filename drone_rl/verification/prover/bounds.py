"""Bounds on images with uncertain faces, and on the network's logits over such images."""

import functools
from collections.abc import Callable, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.policies import ImageNetwork
from drone_rl.policies.layers import Layer, Unsupported, as_layers
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cube_images import NOTHING
from drone_rl.verification.prover.rounded_layers import SLACK, UNIT
from drone_rl.verification.prover.rounding import PIXEL_UNITS, RoundingBound


class NetworkBounds:
    """The possible argmax actions of a network over sets of images.

    Interval bound propagation (Gowal et al., 2018): the sum of an interval's ends passes through a
    linear layer as it is, their difference through the absolute weights. The last layer's weights
    are subtracted pairwise first, so that common terms cancel. ReLU and pooling are positively
    homogeneous, so biases are scaled instead of halving the sums.
    """

    def __init__(self, network: ImageNetwork, gap: float) -> None:
        """Prepare the layers.

        An action is certain only if its logit leads by more than `gap` and by more than the bound
        on rounding errors, see `drone_rl.verification.prover.rounding`.

        Raises:
            InputError: `as_layers` does not support the network.
        """
        layers = as_layers(network)
        if isinstance(layers, Unsupported):
            raise InputError(f"proofs do not support it: {layers.reason}; prove another policy")
        self.gap, self._rounding = gap, RoundingBound(layers)
        *inner, last = layers.in_turn
        scale, self._steps = 2, []
        for layer in inner:
            self._steps.append((_step(layer, scale), scale))
            scale *= 1 if isinstance(layer, _LINEAR) else 2
        self._scale = scale
        weight, bias = (last.get_parameter(name).detach() for name in ("weight", "bias"))
        self.num_actions = len(weight)
        self._first, self._second = (~torch.eye(len(weight), dtype=torch.bool)).nonzero().T
        self._weight = weight[self._first] - weight[self._second]
        self._bias = bias[self._first] - bias[self._second]

    @torch.no_grad()
    def possible(self, lower: Tensor, upper: Tensor) -> Tensor:
        """Return which actions may have the highest logit between bounds of images (N, C, H, W).

        Bit a is clear if another action certainly beats action a. Shape: (N,), uint8.
        """
        total, width = lower + upper, upper - lower
        largest: list[Tensor] = []
        for step, scale in self._steps:
            largest.append(_size(total, width) / scale)
            total, width = step(total, width)
        largest.append(_size(total, width) / self._scale)
        # lower bounds of logit differences, times the scale
        least = functional.linear(total, self._weight, self._scale * self._bias)
        least = least - functional.linear(width, self._weight.abs())
        return self._bits(least > self._scale * self._error(largest).clamp(min=self.gap))

    @torch.no_grad()
    def decide(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """Return the bits of the possible actions of images, and the gap of the top two logits."""
        logits, possible = self._rounding.decide(images)
        loses = ~possible[:, self._second]
        lead = logits[:, self._first] - logits[:, self._second]
        highest = logits.topk(2).values
        return self._bits(loses & (lead > self.gap)), highest[:, 0] - highest[:, 1]

    def _error(self, largest: Sequence[Tensor]) -> Tensor:
        """Return the rounding error of logit differences, and of their bounds. Shape: (pairs,).

        Each is at most the sum of the two logits' errors.
        """
        error = PIXEL_UNITS * UNIT * largest[0].amax().clamp(min=UNIT).expand_as(largest[0])
        for layer, size in zip(self._rounding.layers, largest, strict=True):
            error = layer.bound(size, error)
        both = error[0, self._first] + error[0, self._second]
        return 2 * SLACK * both.nan_to_num(nan=torch.inf)

    def _bits(self, is_certain: Tensor) -> Tensor:
        """Convert certain wins of pairs to the bits of the actions left."""
        bits = torch.full((len(is_certain),), (1 << self.num_actions) - 1, dtype=torch.uint8)
        for loser, beats in zip(self._second.tolist(), is_certain.T, strict=True):
            bits &= torch.where(beats, 255 - (1 << loser), 255).to(torch.uint8)
        return bits


def _size(total: Tensor, width: Tensor) -> Tensor:
    """Return the largest input magnitude, times the scale."""
    return (SLACK * (total.abs() + width).amax(0, keepdim=True)).double()


_AFFINE = (nn.Conv2d, nn.Linear)
_LINEAR = (*_AFFINE, nn.Flatten)  # sums and differences pass through them separately
Step = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]  # of sums and differences of interval ends


def _step(layer: Layer, scale: int) -> Step:
    """Return how intervals pass through a layer; `scale` is the factor of sums before it."""
    if isinstance(layer, _AFFINE):
        weight, bias = layer.weight.detach(), layer.bias
        bias = None if bias is None else scale * bias.detach()
        apply = layer._conv_forward if isinstance(layer, nn.Conv2d) else functional.linear
        return lambda total, width: (apply(total, weight, bias), apply(width, weight.abs(), None))
    if isinstance(layer, nn.Flatten):  # without arithmetic, so without rounding
        return lambda total, width: (layer(total), layer(width))
    return functools.partial(_monotone, layer)  # ReLU and pooling


def _monotone(layer: nn.Module, total: Tensor, width: Tensor) -> tuple[Tensor, Tensor]:
    upper = layer(total + width)
    lower = layer(total.sub_(width))
    return lower + upper, upper.sub_(lower)


def masks_of(faces: Tensor) -> Tensor:
    """Return bit masks of the possible faces where one is possible."""
    return torch.bitwise_left_shift(torch.ones_like(faces), faces)


Crop = tuple[slice, slice]  # rows and columns of an image
_FACES = 4


class Compositor:
    """Composes images of cubes, nearer ones in front, before the background of all images."""

    def __init__(self, background: Tensor, faces: Tensor, rest: Callable[[Tensor], Tensor]) -> None:
        """Store the brightness of the background (height, width) and of the faces (3,), float32.

        The faces are a cube's front, left and right side. `rest` maps images (N, 1, height, width)
        to the network's input and must be monotone.
        """
        self._background = background
        self._rest = rest
        inf = torch.inf
        bits = torch.arange(2**_FACES)[:, None] >> torch.arange(1, _FACES) & 1 == 1
        self._lowest = torch.where(bits, faces, inf).min(-1).values
        self._highest = torch.where(bits, faces, -inf).max(-1).values
        is_open = torch.arange(2**_FACES) >> NOTHING & 1 == 1
        self._shut = torch.where(is_open, 0.0, inf)
        """Added to the background, which counts only where the cube may leave it visible."""

    def paint(
        self, cubes: Sequence[tuple[Crop, Tensor, Tensor]], num_images: int
    ) -> tuple[Tensor, Tensor]:
        """Return lower and upper bounds of images. Shapes: (N, height, width).

        Args:
            cubes: For each cube, nearest first: the crop outside which it is never visible; bit
                masks of the possible faces of each pixel in each case, shape (cases, rows,
                columns), uint8; the case of each image, shape (N,).
            num_images: N.
        """
        lower = self._background.repeat(num_images, 1, 1)
        upper = lower.clone()
        for part, masks, case in reversed(cubes):
            index = masks.int()
            shut = self._shut[index].index_select(0, case)
            low, high = lower[:, *part], upper[:, *part]
            low.add_(shut).clamp_max_(self._lowest[index].index_select(0, case))
            high.sub_(shut).clamp_min_(self._highest[index].index_select(0, case))
        return lower, upper

    def see(self, images: Tensor) -> Tensor:
        """Return the network's input. Shape: (N, height, width) to (N, C, H, W)."""
        return self._rest(images[:, None])


class ImageRanges:
    """The images of one cube in order; each range of them is looked up in two steps.

    Ranges are pairs of first and last image, shape (N, 2).
    """

    def __init__(self, images: Tensor) -> None:
        """Prepare masks of ranges of power-of-two length, from faces (images, height, width)."""
        shown = images.any(0)
        rows, columns = shown.any(1).nonzero(), shown.any(0).nonzero()
        self.part = (
            slice(int(rows.min()), int(rows.max()) + 1) if len(rows) else slice(0, 0),
            slice(int(columns.min()), int(columns.max()) + 1) if len(rows) else slice(0, 0),
        )
        """Crop outside which the cube is never visible."""
        self.images = images = images[:, *self.part].contiguous()
        masks = masks_of(images)
        self._levels = [masks]
        while len(masks) > (reach := 1 << (len(self._levels) - 1)):
            masks = masks[:-reach] | masks[reach:]
            self._levels.append(masks)
        self._doubts = np.full((len(images), len(images)), -1, np.int32)
        """By first and last image; -1 where not yet counted."""

    def of(self, ranges: NDArray) -> tuple[Tensor, Tensor]:
        """Return the masks of the distinct ranges, and the index of each range among them.

        Shapes: (distinct ranges, rows, columns), uint8, and (N,).
        """
        code, case = np.unique(self._code(ranges), return_inverse=True)
        return self._masks(code), torch.from_numpy(case)

    def doubts(self, ranges: NDArray) -> NDArray[np.int64]:
        """Return the number of pixels with several possible faces in each range. Shape: (N,)."""
        code, counts = self._code(ranges), self._doubts.reshape(-1)
        unknown = np.unique(code[counts[code] < 0])
        if len(unknown):
            masks = self._masks(unknown)
            counts[unknown] = (masks & (masks - 1) != 0).flatten(1).sum(-1).numpy()
        return counts[code].astype(np.int64)

    def _code(self, ranges: NDArray) -> NDArray[np.int64]:
        """Return a unique number for each range."""
        return ranges[:, 0] * len(self.images) + ranges[:, 1]

    def _masks(self, code: NDArray[np.int64]) -> Tensor:
        """Return the possible faces of pixels over ranges. Shape: (N, rows, columns)."""
        first, last = np.divmod(code, len(self.images))
        levels = np.frexp(last - first + 1)[1] - 1
        masks = self._levels[0].new_empty(len(code), *self._levels[0].shape[1:])
        for level in np.unique(levels):
            those = np.flatnonzero(levels == level)
            level_masks, reach = self._levels[level], 1 << int(level)
            masks[those] = level_masks[first[those]] | level_masks[last[those] + 1 - reach]
        return masks
