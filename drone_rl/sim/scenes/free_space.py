"""Free space of a scene: the places where a drone fits, on a grid, and shortest paths to goals."""

import functools
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from drone_rl.sim.scenes.path_kernel import Grid

Points = NDArray[np.float64]
"""Metres, world frame. Shape: (n, 3)."""
Distances = Callable[[Points], Points]
"""Maps points to their distances from the nearest solid, metres, negative inside. Shape: (n,)."""
MOST_CELLS = 500_000
_CELL = 0.6
"""Edge of a cell, as a fraction of the drone's radius, unless there would be too many."""
_MARGIN = 0.75
"""Least distance of a path from solids besides the drone's radius, as a fraction of a cell, so that
no solid is between two neighbouring free cells."""
_TINY = 1e-6
"""Length of the edges to sources; 0 would be no edge."""


class FreeSpace:
    """The cells of a box in which a ball fits, and paths through them."""

    def __init__(
        self,
        distances: Distances,
        low: NDArray[Any],
        high: NDArray[Any],
        radius: float,
        altitude: float | None = None,
    ) -> None:
        """Find the free cells.

        Args:
            distances: Returns distances from solids.
            low: Least coordinates of the box, metres. Shape: (3,).
            high: Largest ones.
            radius: Of the ball, metres.
            altitude: Height of a level space; None for one in three dimensions.
        """
        low, high = np.array(low, np.float64), np.array(high, np.float64)
        if altitude is not None:
            low[2] = high[2] = altitude
        self.radius, self.is_level = radius, altitude is not None
        cell = _CELL * radius
        while (shape := np.ceil((high - low) / cell).astype(int) + 1).prod() > MOST_CELLS:
            cell *= 1.05
        self.cell, self._origin = cell, tuple(low.tolist())
        axes = [start + cell * np.arange(n) for start, n in zip(low, shape, strict=True)]
        self.centers: Points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        self.clearance = self._grid(distances(self.centers).reshape(shape))
        """Distances of the centres to the nearest solid, metres."""
        self.margin = _MARGIN * cell
        """Least distance of paths from solids besides the radius, metres."""
        self.is_free: NDArray[np.bool_] = self.clearance.values.ravel() >= radius + self.margin
        """Whether a ball fits at each centre. Shape: (X * Y * Z,)."""

    def _grid(self, values: NDArray[Any]) -> Grid:
        return Grid(np.ascontiguousarray(values, np.float32), self._origin, self.cell)

    def numbers_of(self, points: Points) -> NDArray[np.int64]:
        """Return the numbers of the cells that are nearest to points. (n, 3) to (n,)."""
        shape = self.clearance.values.shape
        at = np.rint((points - self._origin) / self.cell).astype(np.int64)
        return np.array(np.ravel_multi_index(tuple(at.clip(0, np.array(shape) - 1).T), shape))

    @functools.cached_property
    def _graph(self) -> Any:
        """Edges between free cells, numbered among these, with their lengths."""
        shape = self.clearance.values.shape
        padded = np.pad(self.is_free.reshape(shape), 2)
        flat, strides = padded.ravel(), np.array(padded.strides)
        cells = np.flatnonzero(flat)
        number = np.zeros(flat.size, np.int32)
        number[cells] = np.arange(len(cells), dtype=np.int32)
        rows, columns, lengths = [], [], []
        for offset in _offsets(self.is_level):
            there = cells + int(strides @ offset)
            is_edge = flat[there]
            if np.abs(offset).max() > 1:  # a knight's move, between two other cells
                straight = np.sign(offset) * (np.abs(offset) > 1)
                for between in (straight, np.sign(offset)):
                    is_edge = is_edge & flat[cells + int(strides @ between)]
            rows.append(number[cells[is_edge]])
            columns.append(number[there[is_edge]])
            lengths.append(np.full(is_edge.sum(), self.cell * math.hypot(*offset), np.float32))
        size = (len(cells), len(cells))
        parts = (np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns)))
        return sparse.csr_matrix(parts, size)

    @functools.cached_property
    def parts(self) -> NDArray[np.int32]:
        """Number of the connected part of each cell; -1 if it is not free. Shape: (X * Y * Z,)."""
        parts = np.full(self.is_free.shape, -1, np.int32)
        parts[self.is_free] = csgraph.connected_components(self._graph, directed=False)[1]
        return parts

    def lengths_to(
        self, sources: NDArray[np.int64], ahead: NDArray[Any] | float = 0.0
    ) -> tuple[Grid, NDArray[np.bool_]]:
        """Return lengths of the shortest paths to free cells, and which cells have one.

        Args:
            sources: Numbers of the free cells that paths lead to. Shape: (n,).
            ahead: Metres that remain from there. Shape: (n,), or a number.

        Returns:
            Lengths in metres, continued where no ball fits so that they can be interpolated, and
            from which cells paths lead there. Shape: (X * Y * Z,).
        """
        number = np.cumsum(self.is_free) - 1
        graph, count = self._graph, self._graph.shape[0]
        first = np.maximum(np.broadcast_to(ahead, sources.shape), _TINY).astype(np.float32)
        indices = np.concatenate([graph.indices, number[sources].astype(graph.indices.dtype)])
        starts = np.append(graph.indptr, len(indices)).astype(graph.indptr.dtype)
        whole = sparse.csr_matrix(
            (np.concatenate([graph.data, first]), indices, starts), (count + 1, count + 1)
        )
        found = np.full(self.is_free.shape, np.inf)
        found[self.is_free] = csgraph.dijkstra(whole, indices=count)[:-1]
        is_reached = np.isfinite(found)
        shape = self.clearance.values.shape
        continued: Any = ndimage.distance_transform_edt(
            ~is_reached.reshape(shape), sampling=self.cell, return_indices=True
        )
        away, nearest = continued
        return self._grid(found.reshape(shape)[tuple(nearest)] + away), is_reached


def _offsets(is_level: bool) -> list[NDArray[np.int64]]:
    """Return steps to neighbouring cells; in a level grid also knight's moves."""
    most = 2 if is_level else 1
    up = (0,) if is_level else (-1, 0, 1)
    steps = itertools.product(range(-most, most + 1), range(-most, most + 1), up)
    return [np.array(one) for one in steps if any(one) and math.gcd(*one) == 1]
