"""What a policy may do at one x of the drone, wherever the cubes stand to its left or right.

The places of each cube are cut into cells and bands (see `Cells`); the table says of each
combination which actions are possible. It is filled where it is asked for: blocks of pictures are
decided at once if bounds on all of them allow a single action, else cut in two. So most pictures
are never looked at alone.
"""

import functools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.utils.provenance import num_cores
from drone_rl.verification.prover.bounds import Bounds, Painter, Part, Ranges
from drone_rl.verification.prover.boxes import Boxes, blocks, merge, ragged
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import NOTHING

BATCH, CHUNK, ALONE = 4096, 256, 64
"""Blocks that are tried in one go, by one thread at a time, and with no other thread."""
SMALL = 1000
"""Combinations of a span that are simply gone through."""
FEW, PRICE = 8, 6.0
"""Pictures of a block that are simply looked at; and what bounds on a block cost, in pictures."""


class Outlook:
    """The possible actions over all combinations of the places of the cubes in sight."""

    def __init__(
        self, bounds: Bounds, painter: Painter, cells: Sequence[Cells], record: NDArray[np.int64]
    ) -> None:
        """Starts with nothing known.

        Args:
            bounds: Of the network.
            painter: Of its pictures.
            cells: Of each cube in sight, the nearest first.
            record: By how many pixels are in doubt, in powers of two: blocks on which bounds were
                tried, and those that they decided; all outlooks of a proof learn from it. Shape:
                (32, 2).
        """
        self.cells = list(cells)
        self.table = np.zeros([len(c) for c in reversed(self.cells)], np.uint8)
        """Bits of the possible actions, 0 where not yet known. The nearest cube is last."""
        self.pictures = 0
        """How many passes through the network there were."""
        self._gaps = [np.inf]
        self._bounds, self._painter = bounds, painter
        self._ranges = [Ranges(torch.from_numpy(c.pictures)) for c in self.cells]
        self._known = np.zeros([len(c.pictures) for c in reversed(self.cells)], np.uint8)
        """The same of each combination of pictures."""
        self._record = record
        self._hidden = [
            [_alike(near, far, r.part) for near in self.cells[:k]]
            for k, (far, r) in enumerate(zip(self.cells, self._ranges, strict=True))
        ]
        """Of each cube, by each nearer one: see `_alike`."""

    @property
    def least_gap(self) -> float:
        """Between the two highest logits of the pictures that were looked at alone."""
        return min(self._gaps)

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
        unknown = _open(self.table, spans[self._is_unknown(spans)])
        tasks = _open(self._known, self._pictures_of(unknown))
        stack = [tasks] if len(tasks) else []
        while stack:
            tasks = stack.pop()
            if len(tasks) > BATCH:
                stack.append(tasks[:-BATCH])
                tasks = tasks[-BATCH:]
            doubts, counts = self._doubts(tasks), _counts(tasks)
            pixels = doubts.sum(-1)
            tried = np.flatnonzero(self._is_worth(pixels, counts))
            bits = np.zeros(len(tasks), np.uint8)
            bits[tried] = self._share_out(self._bound, tasks[tried])
            self._note(pixels[tried], bits[tried] != 0)
            self._write(tasks[bits != 0], bits[bits != 0])
            is_open = bits == 0
            self._look_at(_combinations(tasks[is_open & (counts <= FEW)]))
            is_open &= counts > FEW
            if is_open.any():
                stack.append(_halve(tasks[is_open], doubts[is_open]))
        for block in unknown:
            self._gather(block)

    def nothing_in_sight(self) -> int:
        """Bits of the possible actions where there is no cube."""
        return int(self._look(np.empty((1, 0), int))[0])

    def _is_unknown(self, spans: NDArray) -> NDArray[np.bool_]:
        """Spans that have something unknown."""
        counts = _counts(spans)
        small, is_unknown = counts <= SMALL, np.zeros(len(spans), bool)
        if small.any():
            known = self.table[tuple(_combinations(spans[small]).T[::-1])]
            begins = np.cumsum(counts[small]) - counts[small]
            is_unknown[small] = np.minimum.reduceat(known, begins) == 0
        for i in np.flatnonzero(~small):
            is_unknown[i] = (self.table[_slices(spans[i])] == 0).any()
        return is_unknown

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

    def _share_out(
        self, work: Callable[[NDArray], NDArray[np.uint8]], blocks: NDArray
    ) -> NDArray[np.uint8]:
        """Has several threads work on a part of the blocks each."""
        self.pictures += len(blocks)
        if len(blocks) <= ALONE:
            return work(blocks) if len(blocks) else np.zeros(0, np.uint8)
        parts = np.array_split(blocks, max(-(-len(blocks) // CHUNK), num_cores()))
        return np.concatenate(list(_workers().map(work, parts)))

    def _look_at(self, combinations: NDArray) -> None:
        """Looks at the different pictures among some, if they were not looked at before."""
        shown = combinations.copy()
        for k, nearer in enumerate(self._hidden):
            for i, alike in enumerate(nearer):
                shown[:, k] = alike[shown[:, i], shown[:, k]]
        code = np.asarray(np.ravel_multi_index(tuple(shown.T[::-1]), self._known.shape))
        known = self._known.reshape(-1)
        new = np.unique(code[known[code] == 0])
        index = np.stack(np.unravel_index(new, self._known.shape)[::-1], -1)
        known[new] = self._share_out(self._look, index)
        self._known[tuple(combinations.T[::-1])] = known[code]

    def _look(self, combinations: NDArray) -> NDArray[np.uint8]:
        """Bits of the possible actions with single pictures, given by their numbers."""
        index = torch.from_numpy(combinations)
        shown = [(r.part, r.pictures[index[:, k]]) for k, r in enumerate(self._ranges)]
        pictures = self._painter.see(self._painter.paint_one(shown, len(index)))
        bits, gaps = self._bounds.decide(pictures)
        self._gaps.append(float(gaps.min()))
        return bits.numpy()

    def _bound(self, blocks: NDArray) -> NDArray[np.uint8]:
        """The only possible action in whole blocks; 0 where bounds leave several."""
        bits = self._bounds.possible(*self._paint(blocks))
        return (bits * (bits & (bits - 1) == 0)).numpy()

    def _paint(self, blocks: NDArray) -> tuple[Tensor, Tensor]:
        cases = [(r.part, *r.of(blocks[:, k])) for k, r in enumerate(self._ranges)]
        lower, upper = self._painter.paint(cases, len(blocks))
        return self._painter.see(lower), self._painter.see(upper)

    def _doubts(self, blocks: NDArray) -> NDArray[np.int64]:
        """How many pixels each cube puts in doubt. Shape: (N, cubes)."""
        if not self._ranges:
            return np.zeros((len(blocks), 0), int)
        return np.stack([r.doubts(blocks[:, k]) for k, r in enumerate(self._ranges)], -1)

    def _is_worth(self, pixels: NDArray, counts: NDArray) -> NDArray[np.bool_]:
        """Blocks of which bounds probably save more pictures than they take the time of."""
        tries, hits = self._record[np.frexp(pixels)[1]].T
        return (hits + 1) * counts > PRICE * (tries + 1)

    def _note(self, doubts: NDArray, done: NDArray[np.bool_]) -> None:
        np.add.at(
            self._record,
            np.frexp(doubts)[1],
            np.stack([np.ones(len(done), int), done.astype(int)], -1),
        )

    def _write(self, blocks: NDArray, bits: NDArray[np.uint8]) -> None:
        self._known[tuple(_combinations(blocks).T[::-1])] = np.repeat(bits, _counts(blocks))


def _open(table: NDArray[np.uint8], spans: NDArray) -> NDArray[np.int64]:
    """Disjoint blocks of all that is unknown in any of some spans; shapes as of spans."""
    if not len(spans) or (len(spans) == 1 and not table[_slices(spans[0])].any()):
        return spans
    lowest, highest = spans[..., 0].min(0), spans[..., 1].max(0)
    is_asked = np.zeros([*(highest - lowest + 1)[::-1]], bool)
    for span in spans:
        is_asked[_slices(span - lowest[:, None])] = True
    is_asked &= table[_slices(np.stack([lowest, highest], -1))] == 0
    found = merge(blocks(is_asked)[:, ::-1])
    return found + lowest[:, None] - [0, 1]


def _counts(blocks: NDArray) -> NDArray[np.int64]:
    """How many combinations each block has."""
    return (blocks[..., 1] - blocks[..., 0] + 1).prod(-1)


def _combinations(blocks: NDArray) -> NDArray[np.int64]:
    """The combinations of all blocks, one after the other. Shape: (total, cubes)."""
    block, place = ragged(_counts(blocks))
    sizes = blocks[..., 1] - blocks[..., 0] + 1
    found = np.empty((len(block), blocks.shape[1]), np.int64)
    for k in range(blocks.shape[1]):
        place, step = np.divmod(place, sizes[block, k])
        found[:, k] = blocks[block, k, 0] + step
    return found


def _halve(blocks: NDArray, doubts: NDArray) -> NDArray:
    """Cuts each block across the cube that puts the most pixels in doubt."""
    longer = blocks[..., 1] > blocks[..., 0]
    cube = np.where(longer, doubts + 1, 0).argmax(-1)
    row = np.arange(len(blocks))
    middle = blocks[row, cube].sum(-1) // 2
    first, second = blocks.copy(), blocks.copy()
    first[row, cube, 1] = middle
    second[row, cube, 0] = middle + 1
    return np.concatenate([first, second])


@functools.cache
def _workers() -> ThreadPoolExecutor:
    """One thread a core; torch computes within each by itself."""
    return ThreadPoolExecutor(
        num_cores(), "prove", initializer=torch.set_num_threads, initargs=(1,)
    )


def _alike(near: Cells, far: Cells, part: Part) -> NDArray[np.int64]:
    """Which picture of a cube looks the same behind each picture of a nearer one.

    Args:
        near: The nearer cube's.
        far: The other one's.
        part: Rows and columns outside which nothing is ever seen of that.

    Returns:
        The first of the neighbours that differ only where the nearer cube stands. Shape: (pictures
        of the nearer one, pictures of the other one).
    """
    behind = far.pictures[:, *part].reshape(len(far.pictures), -1)
    changes = (behind[1:] != behind[:-1]).astype(np.float32)
    is_open = near.pictures[:, *part].reshape(len(near.pictures), -1) == NOTHING
    is_new = is_open.astype(np.float32) @ changes.T > 0
    first = np.zeros((len(is_new), len(behind)), np.int64)
    first[:, 1:] = np.where(is_new, np.arange(1, len(behind)), 0)
    return np.maximum.accumulate(first, axis=1)


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
    if rows.sum() <= most:
        if len(spans):
            yield _runs(outlook.table, spans, np.arange(len(spans)))
        return
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
    rows = (
        table[tuple(cells[::-1])][:, least : most + 1] if cells else table[None, least : most + 1]
    )
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
