"""What a policy may do at one x of the drone, wherever the cubes stand to its left or right.

The places of each cube are cut into cells and bands (see `Cells`); the table says of each
combination which actions are possible. It is filled where it is asked for: blocks of pictures are
decided at once if bounds on all of them allow a single action, else cut in two. So most pictures
are never looked at alone.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.proofs.bounds import Bounds
from drone_rl.proofs.boxes import Boxes, ragged
from drone_rl.proofs.cells import Cells
from drone_rl.proofs.painting import Painter

BATCH = 2048
"""Pictures in one pass."""
SINGLE = (1, 2, 4, 8, 16, 32, 64, 128)
"""Bits of one action."""


class Outlook:
    """The possible actions over all combinations of the places of the cubes in sight."""

    def __init__(self, bounds: Bounds, painter: Painter, cells: Sequence[Cells]) -> None:
        """Starts with nothing known.

        Args:
            bounds: Of the network.
            painter: Of its pictures.
            cells: Of each cube in sight, the nearest first.
        """
        self.cells = list(cells)
        self.table = np.zeros([len(c) for c in reversed(self.cells)], np.uint8)
        """Bits of the possible actions, 0 where not yet known. The nearest cube is last."""
        self.pictures = 0
        """How many passes through the network there were."""
        self.least_gap = np.inf
        """Between the two highest logits of the pictures that were looked at alone."""
        self._bounds, self._painter = bounds, painter
        self._ranges = [Ranges(torch.from_numpy(c.pictures)) for c in self.cells]
        self._known = np.zeros([len(c.pictures) for c in reversed(self.cells)], np.uint8)
        """The same of each combination of pictures."""

    def spans(self, boxes: Boxes) -> NDArray[np.int64]:
        """First and last cell of each cube that boxes reach into.

        Args:
            boxes: Of the cubes in sight, the nearest first, metres to the left of the camera.

        Returns:
            Shape: (N, cubes, 2).
        """
        ends = [c.span(boxes[:, k, 0], boxes[:, k, 1]) for k, c in enumerate(self.cells)]
        return np.stack([np.stack(pair, -1) for pair in ends], 1)

    def fill(self, spans: NDArray[np.int64]) -> None:
        """Makes the table known.

        Args:
            spans: First and last cell of each cube. Shape: (N, cubes, 2).
        """
        unknown = [block for span in spans if (block := self._unknown(span)) is not None]
        if not unknown:
            return
        stack = [self._pictures_of(np.array(unknown))]
        while stack:
            blocks = stack.pop()
            if len(blocks) > BATCH:
                stack.append(blocks[:-BATCH])
                blocks = blocks[-BATCH:]
            rest = self._try(blocks)
            if len(rest):
                stack.append(rest)
        for block in unknown:
            self._gather(block)

    def _unknown(self, span: NDArray) -> NDArray | None:
        """The smallest block around what is not known of one."""
        left = np.argwhere(self.table[_slices(span)] == 0)
        if not len(left):
            return None
        return span[:, :1] + np.stack([left.min(0)[::-1], left.max(0)[::-1]], -1)

    def _pictures_of(self, blocks: NDArray) -> NDArray:
        """From cells and bands to the pictures that they may show."""
        ends = [
            np.stack([c.first[blocks[:, k, 0]], c.last[blocks[:, k, 1]]], -1)
            for k, c in enumerate(self.cells)
        ]
        return np.stack(ends, 1) if ends else blocks

    def _gather(self, block: NDArray) -> None:
        """Takes what is known of pictures over to cells and bands."""
        (pictures,) = self._pictures_of(block[None])
        found = self._known[_slices(pictures)]
        for axis, (cells, span, seen) in enumerate(
            zip(self.cells[::-1], block[::-1], pictures[::-1], strict=True)
        ):
            cell = np.arange(span[0], span[1] + 1)
            ranges = np.stack([cells.first[cell], cells.last[cell] + 1], -1) - seen[0]
            padded = np.concatenate([found, np.take(found, [0], axis)], axis)
            reduced = np.bitwise_or.reduceat(padded, ranges.reshape(-1), axis)
            found = np.take(reduced, np.arange(0, 2 * len(cell), 2), axis)
        self.table[_slices(block)] = found

    def _try(self, blocks: NDArray) -> NDArray:
        """Decides what can be decided; returns the rest, cut in two."""
        cases = [r.of(blocks[:, k]) for k, r in enumerate(self._ranges)]
        lower, upper = (self._painter.see(p) for p in self._painter.paint(cases))
        in_doubt = (lower != upper).flatten(1).any(-1)
        bits = torch.zeros(len(blocks), dtype=torch.uint8)
        if not in_doubt.all():
            bits[~in_doubt], gaps = self._bounds.decide(lower[~in_doubt])
            self.least_gap = min(self.least_gap, float(gaps.min()))
        if in_doubt.any():
            bits[in_doubt] = self._bounds.possible(lower[in_doubt], upper[in_doubt])
        self.pictures += len(blocks)
        done = ~in_doubt.numpy() | np.isin(bits.numpy(), SINGLE)
        self._write(blocks[done], bits.numpy()[done])
        return self._halve(blocks[~done])

    def _write(self, blocks: NDArray, bits: NDArray[np.uint8]) -> None:
        sizes = blocks[..., 1] - blocks[..., 0] + 1
        block, place = ragged(sizes.prod(-1))
        index = []
        for k in range(len(self.cells)):
            place, step = np.divmod(place, sizes[block, k])
            index.append(blocks[block, k, 0] + step)
        self._known[tuple(index[::-1])] = bits[block] if self.cells else bits[0]

    def _halve(self, blocks: NDArray) -> NDArray:
        """Cuts each block across the cube that puts the most pixels in doubt."""
        if not len(blocks):
            return blocks
        doubts = np.stack([r.doubts(blocks[:, k]) for k, r in enumerate(self._ranges)], -1)
        longer = blocks[..., 1] - blocks[..., 0]
        cube = np.where(longer > 0, doubts + 1, 0).argmax(-1)
        row = np.arange(len(blocks))
        middle = blocks[row, cube].sum(-1) // 2
        first, second = blocks.copy(), blocks.copy()
        first[row, cube, 1] = middle
        second[row, cube, 0] = middle + 1
        return np.concatenate([first, second])


class Ranges:
    """What pixels may show of a cube anywhere in ranges of its pictures, looked up in two steps."""

    def __init__(self, pictures: Tensor) -> None:
        """Notes them.

        Args:
            pictures: What each pixel shows. Shape: (pictures, height, width).
        """
        masks = torch.bitwise_left_shift(torch.ones_like(pictures), pictures)
        self._levels = [masks]
        while len(masks) > (reach := 1 << (len(self._levels) - 1)):
            masks = masks[:-reach] | masks[reach:]
            self._levels.append(masks)
        self._doubts: dict[tuple[int, int], int] = {}

    def of(self, ranges: NDArray) -> tuple[Tensor, Tensor]:
        """Masks of the different ranges, and which of them each one is; see `Painter.paint`."""
        different, case = np.unique(ranges, axis=0, return_inverse=True)
        masks = torch.stack([self._mask(a, b) for a, b in different.tolist()])
        return masks, torch.from_numpy(case.reshape(-1))

    def doubts(self, ranges: NDArray) -> NDArray[np.int64]:
        """How many pixels may show several things in each range."""
        different, case = np.unique(ranges, axis=0, return_inverse=True)
        counts = [self._count(a, b) for a, b in different.tolist()]
        return np.array(counts)[case.reshape(-1)]

    def _mask(self, first: int, last: int) -> Tensor:
        level = (last - first + 1).bit_length() - 1
        masks = self._levels[level]
        return masks[first] | masks[last + 1 - (1 << level)]

    def _count(self, first: int, last: int) -> int:
        if (first, last) not in self._doubts:
            mask = self._mask(first, last)
            self._doubts[first, last] = int((mask & (mask - 1) != 0).sum())
        return self._doubts[first, last]


def _slices(span: NDArray) -> tuple[slice, ...]:
    return tuple(slice(a, b + 1) for a, b in span[::-1])


def runs(outlook: Outlook, spans: NDArray[np.int64], most: int) -> Iterator[tuple[NDArray, ...]]:
    """Cuts blocks of the table into rows of one set of possible actions, along the nearest cube.

    Args:
        outlook: Filled there.
        spans: First and last cell of each cube. Shape: (N, cubes, 2).
        most: Rows to be cut in one go, about; bounds memory.

    Yields:
        Of each piece: its block; first and last cell of each cube, shape (cubes, 2); its bits.
    """
    rows = (spans[:, 1:, 1] - spans[:, 1:, 0] + 1).prod(-1)
    parts = np.searchsorted(np.cumsum(rows), np.arange(most, rows.sum() + most, most))
    for part in np.split(np.arange(len(spans)), np.unique(parts)[:-1] + 1):
        if len(part):
            yield _runs(outlook.table, spans, part)


def _runs(table: NDArray, spans: NDArray, part: NDArray) -> tuple[NDArray, ...]:
    sizes = spans[part, 1:, 1] - spans[part, 1:, 0] + 1
    block, place = ragged(sizes.prod(-1))
    cells = []
    for k in range(sizes.shape[1]):
        place, step = np.divmod(place, sizes[block, k])
        cells.append(spans[part, 1 + k, 0][block] + step)
    low, high = spans[part, 0, 0], spans[part, 0, 1]
    least, most = low.min(), high.max()
    rows = table[tuple(cells[::-1])][:, least : most + 1] if cells else table[None, least : most + 1]
    if not cells:
        rows = rows.repeat(len(part), 0)
    places = np.arange(least, most + 1)
    changes = rows[:, 1:] != rows[:, :-1]
    changes &= (places[1:] > low[block][:, None]) & (places[1:] <= high[block][:, None])
    row, change = np.nonzero(changes)
    starts = np.concatenate([low[block], places[1:][change]])
    owner = np.concatenate([np.arange(len(block)), row])
    order = np.lexsort((starts, owner))
    starts, owner = starts[order], owner[order]
    is_last = np.concatenate([owner[1:] != owner[:-1], [True]])
    ends = np.where(is_last, high[block][owner], np.concatenate([starts[1:], [0]]) - 1)
    bits = rows[owner, starts - least]
    ranges = [np.stack([starts, ends], -1)] + [np.stack([c[owner]] * 2, -1) for c in cells]
    return part[block][owner], np.stack(ranges, 1), bits
