"""What a network made of the pictures that were flown by.

Where its weights learn from just those pictures, the way there need not be gone again: it is a
quarter of what a training works out.
"""

import torch
from torch import Tensor


class KnownOutputs:
    """Outputs of all layers, for as long as pictures and weights are those that they came from."""

    def __init__(self, num_rows: int, num_outputs: int) -> None:
        """Nothing is known yet.

        Args:
            num_rows: Of pictures at a time.
            num_outputs: Numbers that all layers make of a picture, see `outputs_at`.
        """
        self.outputs = torch.empty(num_rows, num_outputs)
        """To write into, between `forget` and `note`."""
        self.times = 0
        """How often they were forgotten."""
        self._pictures = self._rows = self._weights = torch.empty(0)
        self._version = 0

    def forget(self) -> None:
        """Says that outputs are about to be written over."""
        self.times += 1
        self._pictures = torch.empty(0)

    def note(self, pictures: Tensor, rows: Tensor, weights: Tensor) -> None:
        """Says what the outputs are of, if there was room for those of all.

        Args:
            pictures: As the network saw them. Shape: (num_pictures, *).
            rows: Of `outputs`, where each one's are, or would be. Shape: (num_pictures,).
            weights: By which they were made, as they are packed; they must stay until `forget`.
        """
        if int(rows.max()) < len(self.outputs):
            self._pictures, self._version = pictures.flatten(1), pictures._version
            self._rows, self._weights = rows.int(), weights

    def find(self, pictures: Tensor, weights: Tensor) -> Tensor | None:
        """Rows of the outputs, if they are of these very pictures, unchanged, by equal weights.

        Args:
            pictures: Some of those noted, one after the other, in the memory where they were; not
                seen are changes behind torch's back. Shape: (k, num_pixels).
            weights: As they are packed.
        """
        known = self._pictures
        if not len(known) or pictures.is_inference() or pictures._version != self._version:
            return None
        here, there = (array.untyped_storage().data_ptr() for array in (pictures, known))
        is_alike = pictures.stride() == known.stride() and pictures.shape[1] == known.shape[1]
        if here != there or not is_alike:
            return None
        numbers = int(pictures.storage_offset()) - int(known.storage_offset())
        first, beside = divmod(numbers, known.shape[1])
        is_known = not beside and torch.equal(weights, self._weights)
        return self._rows[first : first + len(pictures)] if is_known else None
