"""The possible actions at one x of the drone, for all lateral positions of the visible cubes."""

import functools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.utils.provenance import num_cores
from drone_rl.utils.threads import set_torch_threads
from drone_rl.verification.prover.bounds import Compositor, Crop, ImageRanges, NetworkBounds
from drone_rl.verification.prover.boxes import Boxes, blocks, merge, ragged
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import NOTHING

BATCH, CHUNK, ALONE = 4096, 256, 64  # blocks tried at a time, by one thread, and without threads
FEW, PRICE = 8, 6.0  # images evaluated singly; cost of bounds on a block, in images


class ActionTable:
    """The possible actions for all combinations of cells and bands of the visible cubes.

    It is filled on demand: a block of images is decided at once if bounds over all of them leave a
    single action, else it is halved. So most images are never evaluated alone.
    """

    def __init__(
        self,
        bounds: NetworkBounds,
        compositor: Compositor,
        cells: Sequence[Cells],
        record: NDArray[np.int64],
    ) -> None:
        """Start with nothing known of visible cubes, nearest first.

        All tables of a proof share `record` (32, 2): bounds tried, and decisive ones, by log2 of
        the uncertain pixels.
        """
        self.cells = list(cells)
        self.table = np.zeros([len(c) for c in reversed(self.cells)], np.uint8)
        """Bits of the possible actions, 0 if unknown. The nearest cube is last."""
        self.num_images = 0  # number of network evaluations
        self._gaps = [np.inf]
        self._bounds, self._painter = bounds, compositor
        self._ranges = [ImageRanges(torch.from_numpy(c.images)) for c in self.cells]
        self._known = np.zeros([len(c.images) for c in reversed(self.cells)], np.uint8)
        """The same for each combination of images."""
        self._record = record
        self._hidden = [
            [_alike(near, far, r.part) for near in self.cells[:k]]
            for k, (far, r) in enumerate(zip(self.cells, self._ranges, strict=True))
        ]
        """For each cube and each nearer one: see `_alike`."""

    @property
    def least_gap(self) -> float:
        """Smallest gap of the two highest logits among images evaluated singly."""
        return min(self._gaps)

    def spans(self, boxes: Boxes) -> NDArray[np.int64]:
        """Return the first and last cell of each cube that boxes intersect. (N, cubes, 2)."""
        ends = [c.span(boxes[:, k, 0], boxes[:, k, 1]) for k, c in enumerate(self.cells)]
        return np.stack([np.stack(pair, -1) for pair in ends], 1)

    def fill(self, spans: NDArray[np.int64]) -> None:
        """Compute the table within spans, shape (N, cubes, 2)."""
        is_unknown = [bool((self.table[_slices(span)] == 0).any()) for span in spans]
        unknown = _open(self.table, spans[is_unknown])
        tasks = _open(self._known, self._images_of(unknown))
        stack = [tasks] if len(tasks) else []
        while stack:
            tasks = stack.pop()
            if len(tasks) > BATCH:
                stack.append(tasks[:-BATCH])
                tasks = tasks[-BATCH:]
            doubts = np.stack([r.doubts(tasks[:, k]) for k, r in enumerate(self._ranges)], -1)
            pixels, counts = doubts.sum(-1), _counts(tasks)
            tried = np.flatnonzero(self._is_worth(pixels, counts))
            bits = np.zeros(len(tasks), np.uint8)
            bits[tried] = self._share_out(self._bound, tasks[tried])
            note = np.stack([np.ones_like(tried), bits[tried] != 0], -1)
            np.add.at(self._record, np.frexp(pixels[tried])[1], note)
            is_open = bits == 0
            done = tuple(_combinations(tasks[~is_open]).T[::-1])
            self._known[done] = np.repeat(bits[~is_open], counts[~is_open])
            self._evaluate(_combinations(tasks[is_open & (counts <= FEW)]))
            is_open &= counts > FEW
            if is_open.any():
                stack.append(_halve(tasks[is_open], doubts[is_open]))
        for block in unknown:
            self._gather(block)

    def nothing_in_sight(self) -> int:
        """Return the bits of the possible actions without a visible cube."""
        return int(self._decide(np.empty((1, 0), int))[0])

    def _images_of(self, blocks: NDArray) -> NDArray:
        """Convert ranges of cells and bands to ranges of their images."""
        ends = [
            np.stack([c.first[blocks[:, k, 0]], c.last[blocks[:, k, 1]]], -1)
            for k, c in enumerate(self.cells)
        ]
        return np.stack(ends, 1) if ends else blocks

    def _gather(self, block: NDArray) -> None:
        """Combine the actions of images into those of cells and bands."""
        (images,) = self._images_of(block[None])
        actions = self._known[_slices(images)]
        for axis, (cells, span, seen) in enumerate(
            zip(self.cells[::-1], block[::-1], images[::-1], strict=True)
        ):
            cell = np.arange(span[0], span[1] + 1)
            ranges = np.stack([cells.first[cell], cells.last[cell] + 1], -1) - seen[0]
            padded = np.concatenate([actions, np.take(actions, [0], axis)], axis)
            reduced = np.bitwise_or.reduceat(padded, ranges.reshape(-1), axis)
            actions = np.take(reduced, np.arange(0, 2 * len(cell), 2), axis)
        self.table[_slices(block)] = actions

    def _share_out(
        self, work: Callable[[NDArray], NDArray[np.uint8]], blocks: NDArray
    ) -> NDArray[np.uint8]:
        """Evaluate parts of the blocks in several threads."""
        self.num_images += len(blocks)
        if len(blocks) <= ALONE:
            return work(blocks) if len(blocks) else np.zeros(0, np.uint8)
        count = max(-(-len(blocks) // CHUNK), num_cores())
        parts = np.array_split(blocks, min(count, len(blocks)))  # none is empty
        return np.concatenate(list(workers().map(work, parts)))

    def _evaluate(self, combinations: NDArray) -> None:
        """Evaluate the distinct images among some combinations that are not known yet."""
        shown = combinations.copy()
        for k, nearer in enumerate(self._hidden):
            for i, alike in enumerate(nearer):
                shown[:, k] = alike[shown[:, i], shown[:, k]]
        code = np.asarray(np.ravel_multi_index(tuple(shown.T[::-1]), self._known.shape))
        entries = self._known.reshape(-1)
        new = np.unique(code[entries[code] == 0])
        index = np.stack(np.unravel_index(new, self._known.shape)[::-1], -1)
        entries[new] = self._share_out(self._decide, index)
        self._known[tuple(combinations.T[::-1])] = entries[code]

    def _decide(self, combinations: NDArray) -> NDArray[np.uint8]:
        """Return the possible actions of single images, given by their indices."""
        images, _ = self._paint(np.stack([combinations, combinations], -1))
        bits, gaps = self._bounds.decide(images)
        self._gaps.append(float(gaps.min()))
        return bits.numpy()

    def _bound(self, blocks: NDArray) -> NDArray[np.uint8]:
        """Return the only possible action of each block; 0 where bounds leave several."""
        bits = self._bounds.possible(*self._paint(blocks))
        return (bits * (bits & (bits - 1) == 0)).numpy()

    def _paint(self, blocks: NDArray) -> tuple[Tensor, Tensor]:
        """Return lower and upper bounds of the network's input over each block."""
        cases = [(r.part, *r.of(blocks[:, k])) for k, r in enumerate(self._ranges)]
        lower, upper = self._painter.paint(cases, len(blocks))
        return self._painter.see(lower), self._painter.see(upper)

    def _is_worth(self, pixels: NDArray, counts: NDArray) -> NDArray[np.bool_]:
        """Return which blocks bounds probably decide faster than single images would."""
        tries, hits = self._record[np.frexp(pixels)[1]].T
        return (hits + 1) * counts > PRICE * (tries + 1)


def _open(table: NDArray[np.uint8], spans: NDArray) -> NDArray[np.int64]:
    """Return disjoint blocks of all unknown entries within spans."""
    if not len(spans) or (len(spans) == 1 and not table[_slices(spans[0])].any()):
        return spans
    lowest, highest = spans[..., 0].min(0), spans[..., 1].max(0)
    is_wanted = np.zeros([*(highest - lowest + 1)[::-1]], bool)
    for span in spans:
        is_wanted[_slices(span - lowest[:, None])] = True
    is_wanted &= table[_slices(np.stack([lowest, highest], -1))] == 0
    gaps = merge(blocks(is_wanted)[:, ::-1])
    return gaps + lowest[:, None] - [0, 1]


def _counts(blocks: NDArray) -> NDArray[np.int64]:
    """Return the number of combinations of each block."""
    return (blocks[..., 1] - blocks[..., 0] + 1).prod(-1)


def _combinations(blocks: NDArray) -> NDArray[np.int64]:
    """Return the combinations of all blocks. Shape: (total, cubes)."""
    block, place = ragged(_counts(blocks))
    sizes = blocks[..., 1] - blocks[..., 0] + 1
    combinations = np.empty((len(block), blocks.shape[1]), np.int64)
    for k in range(blocks.shape[1]):
        place, step = np.divmod(place, sizes[block, k])
        combinations[:, k] = blocks[block, k, 0] + step
    return combinations


def _halve(blocks: NDArray, doubts: NDArray) -> NDArray:
    """Halve each block along the cube with the most uncertain pixels."""
    longer = blocks[..., 1] > blocks[..., 0]
    cube = np.where(longer, doubts + 1, 0).argmax(-1)
    row = np.arange(len(blocks))
    middle = blocks[row, cube].sum(-1) // 2
    first, second = blocks.copy(), blocks.copy()
    first[row, cube, 1] = middle
    second[row, cube, 0] = middle + 1
    return np.concatenate([first, second])


@functools.cache
def workers() -> ThreadPoolExecutor:
    """Return one thread per core, each running torch with one thread."""
    return ThreadPoolExecutor(num_cores(), "prove", initializer=set_torch_threads, initargs=(1,))


def _alike(near: Cells, far: Cells, part: Crop) -> NDArray[np.int64]:
    """Return which image of a cube is indistinguishable behind each image of a nearer one.

    `part` is the crop of the further cube. Returns the first of the neighbours that differ only
    where the nearer cube is visible. Shape: (images of the nearer cube, images of the further one).
    """
    behind = far.images[:, *part].reshape(len(far.images), -1)
    changes = (behind[1:] != behind[:-1]).astype(np.float32)
    is_open = near.images[:, *part].reshape(len(near.images), -1) == NOTHING
    is_new = is_open.astype(np.float32) @ changes.T > 0
    first = np.zeros((len(is_new), len(behind)), np.int64)
    first[:, 1:] = np.where(is_new, np.arange(1, len(behind)), 0)
    return np.maximum.accumulate(first, axis=1)


def _slices(span: NDArray) -> tuple[slice, ...]:
    return tuple(slice(a, b + 1) for a, b in span[::-1])


def runs(table: ActionTable, spans: NDArray[np.int64], most: int) -> Iterator[tuple[NDArray, ...]]:
    """Cut filled spans, shape (N, cubes, 2), into runs of the nearest cube with constant actions.

    Yields, in batches of about `most` rows: the index in `spans` of each run's span, its first and
    last cell of each cube, shape (cubes, 2), and its bits.
    """
    rows = _counts(spans[:, 1:])
    parts = np.searchsorted(np.cumsum(rows), np.arange(most, rows.sum() + most, most))
    for part in np.split(np.arange(len(spans)), np.unique(parts)[:-1] + 1):
        if len(part):
            yield _runs(table.table, spans, part)


def _runs(table: NDArray, spans: NDArray, part: NDArray) -> tuple[NDArray, ...]:
    block, _ = ragged(_counts(spans[part, 1:]))
    cells = _combinations(spans[part, 1:])  # of the other cubes
    low, high = spans[part, 0, 0], spans[part, 0, 1]
    least, most = low.min(), high.max()
    rows = np.broadcast_to(table[tuple(cells.T[::-1])], (len(block), table.shape[-1]))
    rows = rows[:, least : most + 1]
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
    ranges = [np.stack([starts, ends], -1), *(np.stack([c[owner]] * 2, -1) for c in cells.T)]
    return part[block][owner], np.stack(ranges, 1), bits
