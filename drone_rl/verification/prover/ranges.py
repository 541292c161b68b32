"""What pixels may show of a cube anywhere in ranges of its pictures."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor


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
