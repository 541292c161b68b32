"""Planar arrangements: the cells into which line segments cut a rectangle."""

import dataclasses

import numpy as np
import shapely
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError

SAME = 1e-11  # metres. Shorter segments are left out
_GRID = 2.0**-46  # of the window's size: points this close are one point, to allow for rounding


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

    def lines(self) -> NDArray[np.object_]:
        """Return the segments as geometries, the vertical ones last. Shape: (N + M,)."""
        x, low, high = self.upright.T
        heights = [self.slope * at + self.offset for at in (self.begin, self.end)]
        starts = np.append(self.begin, x), np.append(heights[0], low)
        ends = np.append(self.end, x), np.append(heights[1], high)
        points = np.stack([np.stack(starts, -1), np.stack(ends, -1)], 1)
        return np.asarray(shapely.linestrings(points))


@dataclasses.dataclass(frozen=True)
class Arrangement:
    """The cells of a window."""

    cells: NDArray[np.object_]  # polygons. Shape: (num_cells,)

    def areas(self, above: float = -np.inf) -> NDArray[np.float64]:
        """Return the area, m^2, of each cell or its part above a y. Shape: (num_cells,)."""
        nearest, lowest, farthest, highest = shapely.total_bounds(self.cells)
        part = shapely.box(nearest, np.clip(above, lowest, highest), farthest, highest)
        return shapely.area(shapely.intersection(self.cells, part))

    def locate(self, places: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the cells of positions inside the window, on no border. (N, 2) to (N,)."""
        return shapely.STRtree(self.cells).query(shapely.points(places), "within")[1]

    def inner_points(self) -> NDArray[np.float64]:
        """Return a point well inside each cell. Shape: (num_cells, 2)."""
        return shapely.get_coordinates(shapely.point_on_surface(self.cells))

    def outlines(self, labels: NDArray[np.int64]) -> list[tuple[int, NDArray[np.float64]]]:
        """Return the borders between cells with different labels (num_cells,).

        Each is a label and a closed polygon with that label on its left. Shape: (corners, 2).
        """
        outlines = []
        for label in np.unique(labels):
            region = shapely.union_all(self.cells[labels == label]).simplify(0.0)
            rings = shapely.get_rings(shapely.orient_polygons(shapely.get_parts(region)))
            outlines += [(int(label), shapely.get_coordinates(ring)[:-1]) for ring in rings]
        return outlines


def arrange(pieces: Pieces, window: Window, most_cells: int) -> Arrangement:
    """Compute all cells into which segments inside a window cut it, see `Pieces.clipped`.

    Raises:
        InputError: Segments meet more than 2 * `most_cells` times, which bounds the cells.
    """
    side = window.sideways
    frame = shapely.box(window.nearest, -side, window.farthest, side)
    lines = np.array([*pieces.lines(), frame.exterior])
    meetings = shapely.STRtree(lines).query(lines, "intersects").shape[1]  # each twice
    if meetings > 4 * most_cells:
        raise InputError(
            f"the images of one cube may have more than {most_cells} cells (most_cells); give a "
            "smaller window (farthest, sideways) or raise most_cells"
        )
    edges = shapely.union_all(lines, grid_size=_GRID * max(window.farthest, side))
    cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(edges)))
    area = shapely.area(cells).sum()
    if abs(area - frame.area) > 1e-9 * frame.area:
        raise ArithmeticError(f"cells of {area} m2 do not fill {frame.area} m2")
    return Arrangement(cells)
