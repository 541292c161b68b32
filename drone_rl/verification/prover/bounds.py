"""What a network may do with pictures that are known pixel by pixel between bounds.

Interval bound propagation (Gowal et al., 2018): the sum of an interval's ends goes through a linear
layer as it is, their difference through the absolute values of the weights. Between two actions the
last layer's weights are subtracted first, so that what they have in common cancels. ReLU, pooling
and flattening commute with multiplication, so nothing is halved on the way: biases grow instead.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.collectors.speedups import accelerated_inference
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.rounded_layers import SLACK, UNIT, Layer, layer_of
from drone_rl.policies.rounding import PIXEL_UNITS, RoundingBound
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cube_images import NOTHING


class Bounds:
    """A network's most probable actions, as far as bounds on its pictures tell."""

    def __init__(self, network: PolicyNetwork, gap: float) -> None:
        """Prepares the layers.

        Args:
            network: Ends in a linear layer; before it may stand convolutions, linear layers, ReLU,
                pooling by maxima and flattening.
            gap: An action is the most probable one for certain only if its logit is higher by more
                than this, and by more than the bound on rounding errors, see
                `drone_rl.policies.rounding`.

        Raises:
            InputError: A layer is of another kind.
        """
        *inner, last = network.layers
        if not isinstance(last, nn.Linear):
            raise InputError("the network's last layer is not linear; prove a policy whose is")
        self.gap = gap
        self._answers = accelerated_inference(network)
        scale, self._steps = 2, []
        for layer in inner:
            self._steps.append((_step(layer, scale), scale))
            scale *= 1 if isinstance(layer, _AFFINE) else 2
        self._scale = scale
        weight, bias = last.weight.detach(), last.bias.detach()
        actions = range(len(weight))
        self._pairs = [(a, b) for a in actions for b in actions if a != b]
        first, second = torch.tensor(self._pairs).T
        self._weight = weight[first] - weight[second]
        self._bias = bias[first] - bias[second]
        self.num_actions = len(weight)
        self._errors = [_errors_of(layer) for layer in network.layers]
        self._rounding = RoundingBound(self._errors, getattr(network, "actions", MOVES))
        self._hull: _Hull | None = None

    @torch.no_grad()
    def possible(self, lower: Tensor, upper: Tensor) -> Tensor:
        """Which actions may be the most probable ones.

        Args:
            lower: Pictures as the network sees them, none brighter than what there may be.
            upper: None darker. Shape: (N, C, H, W).

        Returns:
            Bit a is set unless another action is certainly more probable than action a. Shape:
            (N,), uint8.
        """
        largest: list[Tensor] = []
        least = self._least(lower, upper, largest)
        return self._bits(least > self._scale * self._error(largest).clamp(min=self.gap))

    @torch.no_grad()
    def probabilities(self, lower: Tensor, upper: Tensor) -> tuple[Tensor, Tensor]:
        """How probable each action may be if it is drawn.

        Args:
            lower: See `possible`.
            upper: The same.

        Returns:
            At least, and at most. Shapes: (N, actions), float64.
        """
        largest: list[Tensor] = []
        least = self._least(lower, upper, largest).double() / self._scale
        least -= self._error(largest).clamp(min=self.gap)
        lead = torch.zeros(len(least), self.num_actions, self.num_actions, dtype=torch.float64)
        first, second = torch.tensor(self._pairs).T
        lead[:, first, second] = least  # of an action over another one, at least
        return 1 / (-lead).exp().sum(-1), 1 / lead.transpose(1, 2).exp().sum(-1)

    def _least(self, lower: Tensor, upper: Tensor, largest: list[Tensor] | None = None) -> Tensor:
        """By how much logits are higher than others, at least, times the scale. (N, pairs).

        Args:
            lower: See `possible`.
            upper: The same.
            largest: Takes the size of the largest input to each layer. Shapes: (1, *), float64.
        """
        total, width = lower + upper, upper - lower
        for step, scale in self._steps:
            if largest is not None:
                largest.append(_size(total, width) / scale)
            total, width = step(total, width)
        if largest is not None:
            largest.append(_size(total, width) / self._scale)
        least = functional.linear(total, self._weight, self._scale * self._bias)
        return least - functional.linear(width, self._weight.abs())

    @torch.no_grad()
    def decide(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """The same of pictures that are known.

        Args:
            pictures: Shape (N, C, H, W).

        Returns:
            The bits, and the gap between the two highest logits. Shapes: (N,).
        """
        logits = self._answers(pictures)
        first, second = torch.tensor(self._pairs).T
        highest = logits.topk(2).values
        lead = logits[:, first] - logits[:, second]
        bits = self._bits(lead > self._gap(pictures))
        rows = (bits & (bits - 1) != 0).nonzero()[:, 0]
        if len(rows):  # their own bounds are closer than the one for all pictures
            losers = ~self._rounding.decide(pictures[rows]).possible
            clear = losers[:, second] & (lead[rows] > self.gap)
            bits[rows] = self._bits(clear)
        return bits, highest[:, 0] - highest[:, 1]

    def _gap(self, pictures: Tensor) -> Tensor:
        """By how much a logit must be higher than another one to be so whatever is summed first.

        It is enough for all pictures that were seen so far. Shape: (pairs,).
        """
        lower, upper = pictures.amin(0, keepdim=True), pictures.amax(0, keepdim=True)
        hull = self._hull
        if hull is None or bool(((lower < hull.lower) | (upper > hull.upper)).any()):
            if hull is not None:
                lower, upper = torch.minimum(lower, hull.lower), torch.maximum(upper, hull.upper)
            largest: list[Tensor] = []
            self._least(lower, upper, largest)
            gap = self._error(largest).clamp(min=self.gap).float()
            hull = self._hull = _Hull(lower, upper, gap)
        return hull.gap

    def _error(self, largest: Sequence[Tensor]) -> Tensor:
        """Twice the rounding error of the differences of logits. Shape: (pairs,), float64.

        Args:
            largest: From `_least`.
        """
        error = PIXEL_UNITS * UNIT * largest[0].amax().clamp(min=UNIT).expand_as(largest[0])
        for layer, size in zip(self._errors, largest, strict=True):
            error = layer.bound(size, error)
        first, second = torch.tensor(self._pairs).T
        return 2 * SLACK * (error[0, first] + error[0, second]).nan_to_num(nan=torch.inf)

    def _bits(self, is_certain: Tensor) -> Tensor:
        """From which action certainly beats which other one to what is left."""
        bits = torch.full((len(is_certain),), (1 << self.num_actions) - 1, dtype=torch.uint8)
        for (_, loser), beats in zip(self._pairs, is_certain.T, strict=True):
            bits &= torch.where(beats, 255 - (1 << loser), 255).to(torch.uint8)
        return bits


class _Hull(NamedTuple):
    """Bounds on all pictures that were seen so far, and the gap that is enough for them."""

    lower: Tensor
    upper: Tensor
    gap: Tensor


def _errors_of(layer: nn.Module) -> Layer:
    found = layer_of(layer)
    if found is None:
        raise InputError(
            f"the network has a layer {layer}, for which no bound on rounding errors is known; "
            "prove a policy of convolutions without padding, linear layers, ReLU, MaxPool2d and "
            "Flatten"
        )
    return found


def _size(total: Tensor, width: Tensor) -> Tensor:
    """The largest size of inputs by sums and differences of their bounds, times their scale."""
    return (SLACK * (total.abs() + width).amax(0, keepdim=True)).double()


_AFFINE = (nn.Conv2d, nn.Linear)
Step = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""From sums and differences of the ends of intervals to those a layer farther on."""


def _step(layer: nn.Module, scale: int) -> Step:
    """How intervals go through a layer; their sums are so many times their middles before it."""
    if isinstance(layer, nn.Conv2d):
        return _convolution(layer, scale)
    if isinstance(layer, nn.Linear):
        return _linear(layer, scale)
    if isinstance(layer, nn.ReLU | nn.MaxPool2d | nn.Flatten):  # larger inputs, larger outputs
        return lambda total, width: _monotone(layer, total, width)
    raise InputError(
        f"the network has a layer {type(layer).__name__}, for which no bounds are known; prove a "
        "policy of convolutions, linear layers, ReLU, MaxPool2d and Flatten"
    )


def _monotone(layer: nn.Module, total: Tensor, width: Tensor) -> tuple[Tensor, Tensor]:
    upper = layer(total + width)
    lower = layer(total.sub_(width))
    return lower + upper, upper.sub_(lower)


def _convolution(layer: nn.Conv2d, scale: int) -> Step:
    weight, bias = layer.weight.detach(), layer.bias
    bias = None if bias is None else scale * bias.detach()

    def step(total: Tensor, width: Tensor) -> tuple[Tensor, Tensor]:
        # the layer's own way to convolve, with other weights
        return (
            layer._conv_forward(total, weight, bias),
            layer._conv_forward(width, weight.abs(), None),
        )

    return step


def _linear(layer: nn.Linear, scale: int) -> Step:
    weight, bias = layer.weight.detach(), scale * layer.bias.detach()

    def step(total: Tensor, width: Tensor) -> tuple[Tensor, Tensor]:
        return functional.linear(total, weight, bias), functional.linear(width, weight.abs())

    return step


Transform = Callable[[Tensor], Tensor]

Part = tuple[slice, slice]
"""Rows and columns of a picture."""
_FACES = 4


class Painter:
    """Paints cubes over each other, the nearer one in front, before an even background."""

    def __init__(self, background: Tensor, faces: Tensor, rest: Transform | None = None) -> None:
        """Notes the brightness of everything.

        Args:
            background: Of what is seen where no cube is. Shape: (height, width), float32.
            faces: Of a cube's front, left and right side. Shape: (3,), float32.
            rest: What becomes of a picture (N, 1, height, width) before the network sees it;
                brighter pixels must not make anything darker. Nothing by default.
        """
        self._background = background
        self._rest = rest
        inf = torch.inf
        bits = torch.arange(2**_FACES)[:, None] >> torch.arange(1, _FACES) & 1 == 1
        self._shades = torch.cat([faces.new_zeros(1), faces])
        self._lowest = torch.where(bits, faces, inf).min(-1).values
        self._highest = torch.where(bits, faces, -inf).max(-1).values
        is_open = torch.arange(2**_FACES) >> NOTHING & 1 == 1
        self._shut = torch.where(is_open, 0.0, inf)
        """Added to what stands behind: it counts where the cube may leave it open."""

    def paint(
        self, cubes: Sequence[tuple[Part, Tensor, Tensor]], num_pictures: int
    ) -> tuple[Tensor, Tensor]:
        """Bounds on pictures.

        Args:
            cubes: Of each, the nearest first: rows and columns outside which nothing is seen of
                it; masks of what pixels may show there in different cases (bit f for face f),
                shape (cases, rows, columns), uint8; which case each picture is, shape (N,).
            num_pictures: N.

        Returns:
            Lower and upper bounds. Shape: (N, height, width).
        """
        lower = self._background.repeat(num_pictures, 1, 1)
        upper = lower.clone()
        for part, masks, case in reversed(cubes):
            index = masks.int()
            shut = self._shut[index].index_select(0, case)
            low, high = lower[:, *part], upper[:, *part]
            low.add_(shut).clamp_max_(self._lowest[index].index_select(0, case))
            high.sub_(shut).clamp_min_(self._highest[index].index_select(0, case))
        return lower, upper

    def paint_one(self, cubes: Sequence[tuple[Part, Tensor]], num_pictures: int) -> Tensor:
        """Pictures of which everything is known.

        Args:
            cubes: Of each, the nearest first: rows and columns outside which nothing is seen of
                it, and what pixels show there, shape (N, rows, columns), uint8.
            num_pictures: N.

        Returns:
            Shape: (N, height, width).
        """
        pictures = self._background.repeat(num_pictures, 1, 1)
        for part, faces in reversed(cubes):
            shade = self._shades[faces.int()]
            behind = pictures[:, *part]
            behind.copy_(torch.where(faces == NOTHING, behind, shade))
        return pictures

    def see(self, pictures: Tensor) -> Tensor:
        """What the network sees. Shape: (N, height, width) to (N, C, H, W)."""
        return pictures[:, None] if self._rest is None else self._rest(pictures[:, None])


class Ranges:
    """The pictures of one cube, one after the other, each range of them looked up in two steps."""

    def __init__(self, pictures: Tensor) -> None:
        """Notes them.

        Args:
            pictures: What each pixel shows. Shape: (pictures, height, width).
        """
        shown = pictures.any(0)
        rows, columns = shown.any(1).nonzero(), shown.any(0).nonzero()
        self.part = (
            slice(int(rows.min()), int(rows.max()) + 1) if len(rows) else slice(0, 0),
            slice(int(columns.min()), int(columns.max()) + 1) if len(rows) else slice(0, 0),
        )
        """Rows and columns outside which nothing is ever seen of the cube."""
        self.pictures = pictures = pictures[:, *self.part].contiguous()
        masks = torch.bitwise_left_shift(torch.ones_like(pictures), pictures)
        self._levels = [masks]
        while len(masks) > (reach := 1 << (len(self._levels) - 1)):
            masks = masks[:-reach] | masks[reach:]
            self._levels.append(masks)
        self._doubts = np.full((len(pictures), len(pictures)), -1, np.int32)
        """Of each range, by its first and last picture; -1 where not yet counted."""

    def of(self, ranges: NDArray) -> tuple[Tensor, Tensor]:
        """Masks of the different ranges, within the part, and which of them each one is."""
        code, case = np.unique(self._code(ranges), return_inverse=True)
        return self._masks(code), torch.from_numpy(case)

    def doubts(self, ranges: NDArray) -> NDArray[np.int64]:
        """How many pixels may show several things in each range."""
        code, counts = self._code(ranges), self._doubts.reshape(-1)
        unknown = np.unique(code[counts[code] < 0])
        if len(unknown):
            masks = self._masks(unknown)
            counts[unknown] = (masks & (masks - 1) != 0).flatten(1).sum(-1).numpy()
        return counts[code].astype(np.int64)

    def _code(self, ranges: NDArray) -> NDArray[np.int64]:
        """One number for each range."""
        return ranges[:, 0] * len(self.pictures) + ranges[:, 1]

    def _masks(self, code: NDArray[np.int64]) -> Tensor:
        """What pixels may show anywhere in ranges. Shape: (N, rows, columns)."""
        first, last = np.divmod(code, len(self.pictures))
        levels = np.frexp(last - first + 1)[1] - 1
        masks = self._levels[0].new_empty(len(code), *self._levels[0].shape[1:])
        for level in np.unique(levels):
            those = np.flatnonzero(levels == level)
            found, reach = self._levels[level], 1 << int(level)
            masks[those] = found[first[those]] | found[last[those] + 1 - reach]
        return masks
