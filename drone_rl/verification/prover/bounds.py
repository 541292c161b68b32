"""What a network may do with pictures that are known pixel by pixel between bounds.

Interval bound propagation (Gowal et al., 2018): the sum of an interval's ends goes through a linear
layer as it is, their difference through the absolute values of the weights. Between two actions the
last layer's weights are subtracted first, so that what they have in common cancels. ReLU, pooling
and flattening commute with multiplication, so nothing is halved on the way: biases grow instead.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.collectors.speedups import accelerated_inference
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.rounded_layers import SLACK, UNIT, Layer, layer_of
from drone_rl.policies.rounding import PIXEL_UNITS, RoundingBound
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError


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
