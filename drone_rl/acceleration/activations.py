"""Outputs of all layers that a collector's kernel hands to the learner, which needs them, too."""

from typing import NamedTuple

import torch
from torch import Tensor


class Recording(NamedTuple):
    """Outputs of all layers for the observations of one batch."""

    pixels: Tensor
    """Observations, by identity. Shape: (k, C, H, W)."""
    version: int
    """Counter of the changes of `pixels` in place."""
    weights: Tensor
    """Packed weights that gave the outputs."""
    rows: Tensor
    """Row of each observation among the outputs."""


class ActivationRecorder:
    """Memory for the activations of a batch, written by a fused collector once a learner asks.

    The handle of activations is the memory of the observations themselves: a learner that passes
    the batch's pixels, or a slice of them, finds theirs, while a copy is evaluated again, as are
    pixels that were changed in place (by torch; NumPy's writes do not count).
    """

    def __init__(self, num_rows: int, size: int) -> None:
        """Record up to `num_rows` observations with `size` outputs each, from `start` on."""
        self._shape = num_rows, size
        self.outputs = torch.empty(0, size)
        self.recording: Recording | None = None
        """The present batch; None while `outputs` are overwritten, or if they had no room."""

    def start(self) -> None:
        """Allocate the memory, before the next batch."""
        self.outputs = torch.empty(self._shape)

    def record(self, rows: Tensor, weights: Tensor, pixels: Tensor) -> None:
        """Make `outputs` those of a batch; `rows`, (k,), are theirs."""
        if int(rows.max()) < len(self.outputs):
            self.recording = Recording(pixels, pixels._version, weights, rows.int())

    def find(self, pixels: Tensor, weights: Tensor) -> Tensor | None:
        """Return the rows in `outputs` of contiguous observations (k, C * H * W), if they have any.

        `weights` are the packed weights, which must be those that gave the outputs.
        """
        recording = self.recording
        if recording is None or pixels._version != recording.version:
            return None
        size = pixels.shape[1] * pixels.element_size()
        first, rest = divmod(pixels.data_ptr() - recording.pixels.data_ptr(), size)
        last = first + len(pixels)
        is_slice = rest == 0 and first >= 0 and last <= len(recording.rows)
        if not (is_slice and torch.equal(weights, recording.weights)):
            return None
        return recording.rows[first:last]
