"""Bounds on how far float32 arithmetic can move a network's outputs.

A kernel may sum the terms of a layer in any order, and may fuse a product with a sum. Every result
lies within a bound of the exact one (Higham, Accuracy and Stability of Numerical Algorithms, 2002,
chapters 2 to 4). Where two outputs are closer than their bound, the kernel, the batch and the
machine decide which one is larger.

The bound holds for float32 with a unit roundoff of 2^-24, with or without fused products and with
or without subnormal numbers. It does not hold for TF32 or bfloat16, nor for convolutions by
Winograd's or Fourier's transform.
"""

from collections.abc import Callable
from typing import Any, Self

import torch
from torch import Tensor, nn

from drone_rl.policies.layers import Layers, Unsupported, as_layers
from drone_rl.verification.prover.rounded_layers import SLACK, UNIT, largest_of, rounded

PIXEL_UNITS = 8.0
"""Unit roundoffs of the frame's largest pixel by which a pixel may be off: a kernel may fold the
standardization of pixels into one product."""
_BATCH = 256
"""Frames in one pass in float64; bounds memory."""


class RoundingBound:
    """Bounds for the present weights of one network."""

    def __init__(self, layers: Layers) -> None:
        self.layers = [rounded(layer) for layer in layers.in_turn]

    @classmethod
    def find(cls, network: nn.Module) -> Self | None:
        """Return the bounds of a network, or None if `as_layers` does not support it."""
        layers = as_layers(network)
        return None if isinstance(layers, Unsupported) else cls(layers)

    @torch.no_grad()
    def decide(self, pixels: Tensor) -> tuple[Tensor, Tensor]:
        """Return the outputs for frames (N, C, H, W), float32, and which actions are possible.

        An action is possible if it is the best one in some order of summation. One bound for all
        frames decides the clear ones. The others get bounds of their own. Shapes: (N, outputs).
        """
        outputs, error = self.together(pixels)
        best = outputs.argmax(-1, keepdim=True)
        lead = outputs.gather(1, best).double() - outputs.double()
        # each of two evaluations is that far from the exact outputs
        possible = ~(lead > 2 * (error + error[best]))
        possible.scatter_(1, best, True)
        for rows in (possible.sum(-1) > 1).nonzero()[:, 0].split(_BATCH):
            possible[rows] = self.possible(pixels[rows])
        return outputs, possible

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


def _pixel_error(largest: Tensor) -> Tensor:
    return PIXEL_UNITS * UNIT * largest
