"""Lengths of shortest paths through the free space of scenes, in kernels."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp
from numpy.typing import NDArray

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


class Grid(NamedTuple):
    """Numbers at the centres of the cells of a box. Metres, world frame."""

    values: NDArray[np.float32]
    """Shape: (X, Y, Z); Z is 1 for a level grid, whose values hold at all heights."""
    origin: tuple[float, float, float]
    """Centre of the first cell."""
    cell: float
    """Edge of a cell."""


class Route(NamedTuple):
    """Where paths lead: a place of a scene, and the lengths of paths to it. Metres, world frame."""

    lengths: Grid
    """From each cell to the nearest point of the place."""
    center: tuple[float, float, float]
    half_size: tuple[float, float, float]
    """Of the box in which the goal is; zero for a point."""
    heading: float
    """Of the box, radians."""


@wp.struct
class Paths:
    """R routes, one after the other, and those of N environments. Metres, world frame."""

    lengths: wp.array[float]
    """Values of all grids; see `Route`."""
    firsts: wp.array[int]
    """Index of each grid's first value. Shape: (R,), as of what follows."""
    shapes: wp.array[wp.vec3i]
    origins: wp.array[wp.vec3d]
    cells: wp.array[wp.float64]
    centers: wp.array[wp.vec3d]
    halves: wp.array[wp.vec3d]
    turns: wp.array[wp.vec2d]
    """Cosine and sine of the heading."""
    numbers: wp.array2d[wp.float64]
    """Number of the route to each object; -1 for none. Shape: (N, P)."""


def make_paths(routes: Sequence[Route], device: str) -> Any:
    """Return routes for kernels, without those of environments."""
    grids = [route.lengths for route in routes]
    paths: Any = Paths()

    def put(values: Any, kind: Any) -> Any:
        return wp.array(np.array(values), dtype=kind, device=device)

    paths.lengths = put(np.concatenate([grid.values.ravel() for grid in grids]), float)
    paths.firsts = put(np.cumsum([0, *(grid.values.size for grid in grids[:-1])]), int)
    paths.shapes = put([grid.values.shape for grid in grids], wp.vec3i)
    paths.origins = put([grid.origin for grid in grids], wp.vec3d)
    paths.cells = put([grid.cell for grid in grids], wp.float64)
    paths.centers = put([route.center for route in routes], wp.vec3d)
    paths.halves = put([route.half_size for route in routes], wp.vec3d)
    angles = [route.heading for route in routes]
    paths.turns = put([(np.cos(angle), np.sin(angle)) for angle in angles], wp.vec2d)
    return paths


@wp.func
def interpolate(paths: Paths, route: int, point: wp.vec3d) -> wp.float64:
    """Return a value between those of a grid; outside of it that of its nearest place."""
    shape = paths.shapes[route]
    at = (point - paths.origins[route]) / paths.cells[route]
    low = wp.vec3i()
    part = wp.vec3d()
    for axis in range(3):
        last = wp.float64(shape[axis] - 1)
        inside = wp.clamp(at[axis], wp.float64(0.0), last)
        low[axis] = wp.min(int(inside), wp.max(shape[axis] - 2, 0))
        part[axis] = inside - wp.float64(low[axis])
    found = wp.float64(0.0)
    one = wp.float64(1.0)
    for corner in range(8):
        weight = one
        number = int(0)
        for axis in range(3):
            up = (corner >> axis) & 1
            weight = weight * wp.where(up == 1, part[axis], one - part[axis])
            number = number * shape[axis] + wp.min(low[axis] + up, shape[axis] - 1)
        if weight > wp.float64(0.0):
            found = found + weight * wp.float64(paths.lengths[paths.firsts[route] + number])
    return found


@wp.func
def path_length(paths: Paths, route: int, place: wp.vec3d, point: wp.vec3d) -> wp.float64:
    """Return the length of the path from a point to a goal, which goes straight within its box."""
    cos, sin = paths.turns[route][0], paths.turns[route][1]
    away = point - paths.centers[route]
    half = paths.halves[route]
    ahead = wp.clamp(cos * away[0] + sin * away[1], -half[0], half[0])
    left = wp.clamp(cos * away[1] - sin * away[0], -half[1], half[1])
    up = wp.clamp(away[2], -half[2], half[2])
    entered = paths.centers[route] + wp.vec3d(
        cos * ahead - sin * left, sin * ahead + cos * left, up
    )
    return interpolate(paths, route, point) + wp.length(place - entered)


@wp.kernel
def path_lengths(
    paths: Paths,
    routes: wp.array[int],
    places: wp.array[wp.vec3d],
    points: wp.array2d[wp.vec3d],
    lengths: wp.array2d[wp.float64],
) -> None:
    """Write lengths of paths from many points of each environment to its goal."""
    env, i = wp.tid()
    lengths[env, i] = path_length(paths, routes[env], places[env], points[env, i])
