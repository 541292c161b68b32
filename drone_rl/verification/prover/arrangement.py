"""Planar arrangements: the cells into which line segments cut a rectangle."""

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drone_rl.utils.errors import InputError

SAME = 1e-11  # metres. Points closer than this in x and y are one point, to allow for rounding


@dataclasses.dataclass(frozen=True)
class Window:
    """A rectangle of cube positions relative to the camera."""

    nearest: float  # smallest x, metres
    farthest: float  # largest x
    sideways: float  # largest |y|


@dataclasses.dataclass(frozen=True)
class Pieces:
    """Line segments: y = slope x + offset from x = begin to end, and vertical ones."""

    slope: NDArray[np.float64]
    offset: NDArray[np.float64]
    begin: NDArray[np.float64]
    end: NDArray[np.float64]  # shapes: (N,)
    upright: NDArray[np.float64]  # x, lowest and highest y of each vertical segment. Shape: (M, 3)

    def clipped(self, window: Window) -> "Pieces":
        """Return the parts inside the window."""
        side, slope, offset = window.sideways, self.slope, self.offset
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(-side - offset) / slope, (side - offset) / slope])
        level = slope == 0
        inside = np.where(np.abs(offset) < side - SAME, np.inf, -np.inf)
        first = np.where(level, -inside, ends.min(0))
        last = np.where(level, inside, ends.max(0))
        begin = np.maximum(np.maximum(self.begin, first), window.nearest)
        end = np.minimum(np.minimum(self.end, last), window.farthest)
        kept = end - begin > SAME
        x, low, high = self.upright.T
        low, high = np.maximum(low, -side), np.minimum(high, side)
        stands = (np.minimum(x - window.nearest, window.farthest - x) > SAME) & (high - low > SAME)
        upright = np.stack([x, low, high], -1)[stands]
        return Pieces(slope[kept], offset[kept], begin[kept], end[kept], upright)

    def framed(self, window: Window) -> "Pieces":
        """Return the segments and the four sides of the window."""
        side, ends = window.sideways, (window.nearest, window.farthest)
        return Pieces(
            np.append(self.slope, [0.0, 0.0]),
            np.append(self.offset, [-side, side]),
            np.append(self.begin, [ends[0]] * 2),
            np.append(self.end, [ends[1]] * 2),
            np.concatenate([self.upright, [[x, -side, side] for x in ends]]),
        )


@dataclasses.dataclass(frozen=True)
class Arrangement:
    """Cells as half-edges. The second half of the half-edges are the twins of the first half.

    The segments, cut where they meet, are the edges of a plane graph; each edge is two half-edges,
    one per adjacent cell. A cell is a cycle of half-edges, each followed by the one that turns
    furthest left, so no cell is missed.
    """

    points: NDArray[np.float64]  # points where segments meet or end. Shape: (P, 2)
    origin: NDArray[np.int64]  # index of the start point of each half-edge. Shape: (E,)
    angle: NDArray[np.float64]  # direction of each half-edge, radians. Shape: (E,)
    following: NDArray[np.int64]  # next half-edge around the cell to its left. Shape: (E,)
    cell: NDArray[np.int64]  # cell of each half-edge; -1 outside the window. Shape: (E,)
    num_cells: int

    @property
    def twin(self) -> NDArray[np.int64]:
        """The same edge in the opposite direction. Shape: (E,)."""
        return np.roll(np.arange(len(self.origin)), len(self.origin) // 2)

    def areas(self, above: float | None = None) -> NDArray[np.float64]:
        """Return the area, m^2, of each cell or its part above a y. Shape: (num_cells,)."""
        of = self.cell >= 0
        cell, after = self.cell[of], self.following[of]
        corner = np.empty(self.num_cells, np.int64)
        corner[cell] = self.origin[of]
        base = self.points[corner[cell]]  # relative coordinates keep the precision of small cells
        x, y = (self.points[self.origin[of]] - base).T
        next_x, next_y = (self.points[self.origin[after]] - base).T
        mean = (y + next_y) / 2
        if above is not None:
            y, next_y = y - (above - base[:, 1]), next_y - (above - base[:, 1])
            higher, lower = np.maximum(y, next_y), np.minimum(y, next_y)
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.maximum(higher, 0.0) ** 2 / (2 * (higher - lower))
            mean = np.where(lower >= 0, (y + next_y) / 2, np.where(higher > 0, part, 0.0))
        return np.bincount(cell, (x - next_x) * mean, self.num_cells).astype(np.float64)

    def locate(self, places: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the cells of positions inside the window, on no border. (N, 2) to (N,)."""
        origin, end = self.points[self.origin], self.points[self.origin[self.twin]]
        goes_right = np.flatnonzero((end[:, 0] - origin[:, 0] > 0) & (self.cell >= 0))
        (x, y), (far_x, far_y) = origin[goes_right].T, end[goes_right].T
        slope = (far_y - y) / (far_x - x)
        cells = np.empty(len(places), np.int64)
        for number, (here, up) in enumerate(places):
            height = y + slope * (here - x)
            below = np.flatnonzero((x <= here) & (here < far_x) & (height <= up))
            cells[number] = self.cell[goes_right[below[height[below].argmax()]]]
        return cells

    def inner_points(self) -> NDArray[np.float64]:
        """Return a point well inside each cell. Shape: (num_cells, 2)."""
        of = self.cell >= 0
        cell = self.cell[of]
        corners = self.points[self.origin[of]]
        count = np.bincount(cell, minlength=self.num_cells)
        sums = [np.bincount(cell, c, self.num_cells) for c in corners.T]
        points = np.stack(sums, -1) / count[:, None]
        turn = (self.angle[self.following] - self.angle + np.pi) % (2 * np.pi) - np.pi
        for dented in np.unique(self.cell[(turn < -SAME) & of]):
            points[dented] = _inside(self.points[self.origin[self._around(dented)]])
        return points

    def outlines(self, labels: NDArray[np.int64]) -> list[tuple[int, NDArray[np.float64]]]:
        """Return the borders between cells with different labels (num_cells,).

        Each is a label and a closed polygon with that label on its left. Shape: (corners, 2).
        """
        label = np.append(labels, -1)[self.cell]
        twin = self.twin
        is_border = (label != label[twin]) & (label >= 0)
        edges = np.flatnonzero(is_border)
        following = self.following[edges]
        while (inner := ~is_border[following]).any():
            following[inner] = self.following[twin[following[inner]]]
        after = dict(zip(edges.tolist(), following.tolist(), strict=True))
        outlines = []
        while after:
            edge, border = next(iter(after)), []
            while edge in after:
                border.append(edge)
                edge = after.pop(edge)
            angles = self.angle[border]
            corner = angles != np.roll(angles, 1)
            outlines.append((int(label[border[0]]), self.points[self.origin[border]][corner]))
        return outlines

    def _around(self, cell: int) -> list[int]:
        around = [int(np.flatnonzero(self.cell == cell)[0])]
        while (edge := int(self.following[around[-1]])) != around[0]:
            around.append(edge)
        return around


def arrange(pieces: Pieces, window: Window, most_cells: int) -> Arrangement:
    """Compute all cells into which segments inside a window cut it, see `Pieces.clipped`.

    Collinear segments must not overlap; each must connect, perhaps indirectly, to a window side.

    Raises:
        InputError: Segments meet more than 2 * `most_cells` times, which bounds the cells.
    """
    pieces = pieces.framed(window)
    points, piece = _meetings(pieces, most_cells)
    points, vertex = _merged(points)
    order = np.lexsort((points[vertex, 1], points[vertex, 0], piece))
    piece, vertex = piece[order], vertex[order]
    edge = np.flatnonzero((piece[1:] == piece[:-1]) & (vertex[1:] != vertex[:-1]))
    first, last, piece = vertex[edge], vertex[edge + 1], piece[edge]
    angle = np.append(np.arctan(pieces.slope), np.full(len(pieces.upright), np.pi / 2))[piece]
    origin = np.concatenate([first, last])
    angle = np.concatenate([angle, angle + np.pi])
    following = _following(origin, angle)
    graph = coo_array((np.ones(len(origin), bool), (np.arange(len(origin)), following)))
    num_cells, cell = connected_components(graph, directed=False)
    arrangement = Arrangement(points, origin, angle, following, cell.astype(np.int64), num_cells)
    areas = arrangement.areas()
    is_outside = areas <= 0
    number = np.where(is_outside, -1, np.cumsum(~is_outside) - 1)
    inside, area = areas[~is_outside], 2 * window.sideways * (window.farthest - window.nearest)
    if abs(inside.sum() - area) > 1e-9 * area:
        raise ArithmeticError(f"cells of {inside.sum()} m2 do not fill {area} m2")
    return dataclasses.replace(arrangement, cell=number[arrangement.cell], num_cells=len(inside))


def _meetings(pieces: Pieces, most: int) -> tuple[NDArray, NDArray]:
    """Return where segments meet and end, and the segment of each; vertical ones last."""
    slope, offset, begin, end = pieces.slope, pieces.offset, pieces.begin, pieces.end
    count = len(slope)
    index = np.arange(count)
    xs, ys, ons = [begin, end], [slope * begin + offset, slope * end + offset], [index, index]
    total = 0
    for i in range(count - 1):
        with np.errstate(divide="ignore", invalid="ignore"):
            x = (offset[i + 1 :] - offset[i]) / (slope[i] - slope[i + 1 :])
        first, last = np.maximum(begin[i + 1 :], begin[i]), np.minimum(end[i + 1 :], end[i])
        meets = np.flatnonzero((x >= first - SAME) & (x <= last + SAME))
        x = x[meets]
        y = slope[i] * x + offset[i]
        xs += [x, x]
        ys += [y, y]
        ons += [np.full(len(x), i), meets + i + 1]
        total += len(x)
        if total > 2 * most:
            break
    for number, (x, low, high) in enumerate(pieces.upright):
        y = slope * x + offset
        reaches = (begin - SAME <= x) & (x <= end + SAME)
        meets = np.flatnonzero(reaches & (low - SAME <= y) & (y <= high + SAME))
        y = np.concatenate([y[meets], y[meets], [low, high]])
        xs.append(np.full(len(y), x))
        ys.append(y)
        ons.append(np.append(meets, np.full(len(meets) + 2, count + number)))
        total += len(meets)
    if total > 2 * most:
        raise InputError(
            f"the images of one cube may have more than {most} cells (most_cells); give a smaller "
            "window (farthest, sideways) or raise most_cells"
        )
    return np.stack([np.concatenate(xs), np.concatenate(ys)], -1), np.concatenate(ons)


def _merged(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the distinct points, and the index of each point among them."""
    column = _groups(points[:, 0], np.zeros(len(points), np.int64))
    _, first = np.unique(column, return_index=True)
    x = points[first[column], 0]  # identical along a vertical segment, whose points are sorted
    group = _groups(points[:, 1], column)
    _, first = np.unique(group, return_index=True)
    return np.stack([x, points[:, 1]], -1)[first], group


def _groups(values: NDArray[np.float64], within: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number the groups of equal values within each outer group."""
    order = np.lexsort((values, within))
    value, outer = values[order], within[order]
    is_new = np.append(False, (np.diff(value) > SAME) | (np.diff(outer) != 0))
    group = np.empty(len(values), np.int64)
    group[order] = np.cumsum(is_new)
    return group


def _following(origin: NDArray[np.int64], angle: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the next half-edge of each: at its end, the next one clockwise from its twin."""
    count = len(origin)
    order = np.lexsort((angle, origin))
    start = np.append(True, np.diff(origin[order]) != 0)
    first = np.flatnonzero(start)
    last = np.append(first[1:], count) - 1
    before = np.arange(count) - 1
    before[first] = last
    clockwise = np.empty(count, np.int64)
    clockwise[order] = order[before]
    return clockwise[np.roll(np.arange(count), count // 2)]


def _inside(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a point inside a counterclockwise polygon without holes."""
    at = int(np.lexsort(corners.T[::-1])[0])
    first, tip, last = corners[at - 1], corners[at], corners[(at + 1) % len(corners)]
    triangle = np.array([first, tip, last])
    weights = np.linalg.solve(
        np.vstack([triangle.T, np.ones(3)]), np.vstack([corners.T, np.ones(len(corners))])
    )
    away = weights[[0, 2]].sum(0)  # 0 at the tip, 1 on the side across from it
    within = (weights > SAME).all(0)
    if not within.any():
        return triangle.mean(0)
    nearest = np.flatnonzero(within)[away[within].argmin()]
    return (tip + corners[nearest]) / 2
