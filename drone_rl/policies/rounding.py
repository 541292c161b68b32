"""Bounds on how far float32 arithmetic can move a network's outputs.

A kernel may sum the terms of a layer in any order, and may fuse a product with a sum. Every result
lies within a bound of the exact one (Higham, Accuracy and Stability of Numerical Algorithms, 2002,
chapters 2 to 4). Where two outputs are closer than their bound, the kernel, the batch and the
machine decide which one is larger. A frame is *fragile* if that is so of its two best actions.

The bound holds for float32 with a unit roundoff of 2^-24, with or without fused products and with
or without subnormal numbers. It does not hold for TF32 or bfloat16, nor for convolutions by
Winograd's or Fourier's transform.
"""

import copy
import dataclasses
from collections.abc import Callable, Iterable
from typing import Any, Self

import torch
from torch import Tensor, nn

from drone_rl.policies.layers import Layers, Unsupported, as_layers
from drone_rl.policies.networks import ImageNetwork
from drone_rl.policies.rounded_layers import SLACK, UNIT, largest_of, rounded
from drone_rl.sim.actions import Actions, DiscreteActions
from drone_rl.utils.errors import InputError

PIXEL_UNITS = 8.0
"""Unit roundoffs of the frame's largest pixel by which a pixel may be off: a kernel may fold the
standardization of pixels into one product."""
ACTION_ERROR = 0.1
"""A frame is fragile if rounding can move an output for a continuous action by more than that."""
TOLERANCE = 1e-4
"""Error that is assumed of a network of unknown layers, relative to 1 + its largest logit."""
_BATCH = 256
"""Frames in one pass in float64; bounds memory."""


@dataclasses.dataclass(frozen=True)
class Decisions:
    """Decisions of a network on frames, and whether rounding can change them."""

    outputs: Tensor
    """Of the network, in float32. Shape: (N, outputs)."""
    possible: Tensor
    """Whether some order of summation makes an action the best one. For continuous actions, all
    entries of a fragile frame are True, and those of any other False. Shape: (N, outputs), bool."""

    @property
    def is_fragile(self) -> Tensor:
        """Frames with more than one possible action. Shape: (N,), bool."""
        return self.possible.sum(-1) > 1


Decide = Callable[[Tensor], Decisions]
"""Frames (N, C, H, W) to decisions."""


class RoundingBound:
    """Bounds for the present weights of one network."""

    def __init__(self, layers: Layers, actions: Actions) -> None:
        self.layers = [rounded(layer) for layer in layers.in_turn]
        self._actions = actions

    @classmethod
    def find(cls, network: nn.Module) -> Self | None:
        """Return the bounds of a network, or None if `as_layers` does not support it."""
        layers = as_layers(network)
        if isinstance(layers, Unsupported):
            return None
        actions: Any = network.actions
        return cls(layers, actions)

    @torch.no_grad()
    def decide(self, pixels: Tensor) -> Decisions:
        """Return which actions are possible for frames (N, C, H, W), float32.

        One bound for all frames decides the clear ones. The others get bounds of their own.
        """
        outputs, error = self.together(pixels)
        if not isinstance(self._actions, DiscreteActions):
            means = outputs.shape[-1] // 2
            is_open = ~(error[:means, None] <= ACTION_ERROR).all().expand(len(pixels))
            rows = is_open.nonzero()[:, 0]
            for some in rows.split(_BATCH):
                each = self.errors(pixels[some])[:, :means]
                is_open = is_open.index_copy(0, some, ~(each <= ACTION_ERROR).all(-1))
            return Decisions(outputs, is_open[:, None].expand_as(outputs))
        best = outputs.argmax(-1, keepdim=True)
        lead = outputs.gather(1, best).double() - outputs.double()
        # each of two evaluations is that far from the exact outputs
        possible = ~(lead > 2 * (error + error[best]))
        possible.scatter_(1, best, True)
        for rows in (possible.sum(-1) > 1).nonzero()[:, 0].split(_BATCH):
            possible[rows] = self.possible(pixels[rows])
        return Decisions(outputs, possible)

    @torch.no_grad()
    def together(self, pixels: Tensor) -> tuple[Tensor, Tensor]:
        """Return the outputs for frames (N, C, H, W), float32, and one bound for all frames.

        The bound is each output's largest error, (outputs,), float64; infinite if it may overflow.
        """
        largest = largest_of(pixels)
        error = _pixel_error(largest.amax().clamp(min=UNIT)).expand_as(largest)
        value = pixels
        for layer in self.layers:
            error = layer.bound(value, error)
            value = layer(value)
        return value, error[0].nan_to_num(nan=torch.inf)

    @torch.no_grad()
    def errors(self, pixels: Tensor) -> Tensor:
        """Return the error of each output of each frame. Shape: (N, outputs), float64."""

        def each(value: Tensor) -> Tensor:
            eye = torch.eye(value.shape[-1], dtype=torch.float64, device=value.device)
            return eye.repeat(len(value), 1, 1)

        return self._back(pixels, each)[1]

    @torch.no_grad()
    def possible(self, pixels: Tensor) -> Tensor:
        """Return which actions are possible for each of the frames (N, C, H, W), float32.

        An action is possible if its exact logit is below the best one's by no more than the error
        bound of their difference.
        """

        def leads(value: Tensor) -> Tensor:
            eye = torch.eye(value.shape[-1], dtype=torch.float64, device=value.device)
            best = value.nan_to_num().argmax(-1)
            return eye[best][:, None] - eye

        value, error = self._back(pixels, leads)
        lead = value.amax(-1, keepdim=True) - value
        possible = ~(lead > error)
        return possible.scatter(1, value.nan_to_num().argmax(-1, keepdim=True), True)

    def _run(self, pixels: Tensor) -> tuple[Tensor, Tensor, list[Any], Tensor]:
        """Return outputs, pixel errors, the layers' notes, and frames whose sums may overflow."""
        value = pixels.double()
        first = _pixel_error(value.abs().flatten(1).amax(-1).clamp(min=UNIT))
        first = first[:, None, None, None].expand_as(value)
        error, notes = first, []
        overflows = torch.zeros(len(pixels), dtype=torch.bool, device=pixels.device)
        for layer in self.layers:
            value, error, note = layer.run(value, error)
            overflows |= ~error.flatten(1).isfinite().all(-1)
            notes.append(note)
        return value, first, notes, overflows

    def _back(self, pixels: Tensor, weigh: Callable[[Tensor], Tensor]) -> tuple[Tensor, Tensor]:
        """Return outputs, and errors of P weighted sums of them, (N, P), by a backward pass.

        Every rounding error moves the outputs by its slope, as long as no ReLU and no maximum
        changes sides. Those that may are sources of error themselves.
        """
        value, first, notes, overflows = self._run(pixels)
        slope = weigh(value)
        total = torch.zeros(slope.shape[:2], dtype=torch.float64, device=pixels.device)
        for layer, note in zip(reversed(self.layers), reversed(notes), strict=True):
            if note.local is not None:
                total += (slope.abs() * note.local[:, None]).flatten(2).sum(-1)
            slope = layer.back(slope, note)
        total += (slope.abs() * first[:, None]).flatten(2).sum(-1)
        total = SLACK * total.nan_to_num(nan=torch.inf)
        return value, total.masked_fill(overflows[:, None], torch.inf)


def decider(network: nn.Module) -> tuple[Decide, bool]:
    """Return how to decide with a network, and whether a bound for its layers is known.

    Without a bound, an error of `TOLERANCE` is assumed or, of a torch module, twice the difference
    between its outputs in float32 and in float64 if that is larger. Of continuous actions none
    counts as possible, so that no frame is fragile.
    """
    bound = RoundingBound.find(network)
    if bound is not None:
        return bound.decide, True
    exact = _in_float64(network)

    @torch.no_grad()
    def assume(pixels: Tensor) -> Decisions:
        outputs: Tensor = network(pixels)
        if not isinstance(network.actions, DiscreteActions):
            return Decisions(outputs, torch.zeros_like(outputs, dtype=torch.bool))
        lead = outputs.amax(-1, keepdim=True) - outputs
        error = TOLERANCE * (1 + outputs.abs().amax(-1, keepdim=True)).double()
        if exact is not None:
            off = (exact(pixels.double()) - outputs).abs().amax(-1, keepdim=True)
            error = torch.maximum(error, 2 * off)
        return Decisions(outputs, ~(lead > error))

    return assume, False


def arithmetic_on(device: torch.device) -> tuple[str, bool]:
    """Return the name of the arithmetic of a device, and whether the bounds hold for it.

    They do not where cuDNN may round the inputs of convolutions to TF32, as it does by default, or
    may choose other convolution algorithms than direct sums; so on no GPU.
    """
    if device.type == "cuda" and torch.backends.cudnn.allow_tf32:
        return f"float32 (convolutions in TF32) on {device.type}", False
    return f"float32 on {device.type}", device.type == "cpu"


def _in_float64(network: nn.Module) -> nn.Module | None:
    """Return a copy that computes in float64; None without weights or with a fixed precision."""
    if not isinstance(network, ImageNetwork) or not network.has_weights:
        return None
    device = next(network.parameters()).device
    exact = copy.deepcopy(network).double()
    try:
        with torch.no_grad():
            exact(torch.zeros(1, *network.in_shape, dtype=torch.float64, device=device))
    except (RuntimeError, TypeError, ValueError):
        return None
    return exact


def _pixel_error(largest: Tensor) -> Tensor:
    return PIXEL_UNITS * UNIT * largest


REMEDY = (
    "give a callable without state, whose logits for a frame depend on no other frame of its batch"
)
"""What to do about a callable whose outputs depend on the batch."""


class Regrouped(ImageNetwork):
    """Evaluates a network in other batches than given.

    If its outputs depend on the frame alone, they stay the same up to rounding.
    """

    def __init__(self, network: ImageNetwork, groups: str, seed: int = 0) -> None:
        """Wrap a network.

        `groups` is "single", one frame a call, or "mixed": batches of random order and size, each
        with some of its frames twice.
        """
        super().__init__()
        self.network, self.groups = network, groups
        self.in_shape, self.actions = network.in_shape, network.actions
        self._generator = torch.Generator().manual_seed(seed)

    @property
    def parts(self) -> nn.Module:
        """Parts of the wrapped network."""
        return self.network.parts

    def forward(self, pixels: Tensor) -> Tensor:
        """See `ImageNetwork`. Shapes: (N, C, H, W), (N, outputs)."""
        if self.groups == "single":
            return torch.cat([self.network(one) for one in pixels.split(1)])
        outputs = pixels.new_empty(len(pixels), self.num_actions)
        order = torch.randperm(len(pixels), generator=self._generator)
        while len(order):
            size = self._sample_size(len(order))
            rows, order = order[:size], order[size:]
            repeats = self._sample_size(size + 1) - 1
            again = torch.randint(size, (repeats,), generator=self._generator)
            repeated = torch.cat([rows, rows[again]]).to(pixels.device)
            outputs[rows.to(pixels.device)] = self.network(pixels[repeated])[:size]
        return outputs

    def _sample_size(self, most: int) -> int:
        """Return a random number from 1 to `most`, small ones more often."""
        share = float(torch.rand((), generator=self._generator))
        return min(most, 1 + int((most + 1) ** share - 1))


@torch.no_grad()
def require_same_in_any_batch(network: ImageNetwork, frames: Tensor, sizes: Iterable[int]) -> None:
    """Raise an `InputError` if outputs for frames (N, C, H, W) depend on the size of the batch."""
    rows = torch.linspace(0, len(frames) - 1, min(len(frames), 64)).long().to(frames.device)
    frames = frames[rows]
    alone = torch.cat([network(frame) for frame in frames.split(1)])
    allowed = TOLERANCE * (1 + alone.abs().amax(-1))
    for size in sizes:
        which = (torch.arange(size, device=frames.device) + size) % len(frames)
        difference = (network(frames[which]) - alone[which]).abs().amax(-1)
        if bool((difference > allowed[which]).any()):
            raise InputError(
                f"{network.owner} gives other logits for the same frame in a batch of {size}: they "
                f"differ by {float(difference.max()):.3g}; {REMEDY}"
            )
