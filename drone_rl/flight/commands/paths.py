"""Paths of straight lines: where along one a drone is, and what lies ahead.

Everything is batched: `num_worlds` paths of P points each, the last of which may be repeated.
Places are metres in the world's frame; how far along a path something is, is metres too.
"""

import dataclasses
from collections.abc import Sequence

import torch
from torch import Tensor


@dataclasses.dataclass(frozen=True)
class Paths:
    """Lines from point to point, `num_worlds` paths."""

    points: Tensor  # (num_worlds, P, 3) float64
    """Through which they go, in order."""
    along: Tensor  # (num_worlds, P) float64
    """How far along its path each point is."""
    directions: Tensor  # (num_worlds, P - 1, 3) float64
    """Unit vectors from each point to the next; zeros between points that are the same."""

    @property
    def ends(self) -> Tensor:
        """The last points. Shape: (num_worlds, 3)."""
        return self.points[:, -1]

    @property
    def lengths(self) -> Tensor:
        """Of whole paths. Shape: (num_worlds,)."""
        return self.along[:, -1]


def make_paths(points: Tensor) -> Paths:
    """Paths through points. Shape: (num_worlds, P, 3), P at least 2."""
    steps = points.diff(dim=1)
    lengths = steps.norm(dim=-1)
    along = torch.nn.functional.pad(lengths.cumsum(-1), (1, 0))
    return Paths(points, along, steps / lengths.clamp(min=1e-12)[..., None])


def stacked(paths: Sequence[Tensor]) -> Tensor:
    """Paths of different numbers of points as one tensor; ends are repeated.

    Args:
        paths: Points of each. Shapes: (P, 3).
    """
    most = max(map(len, paths))
    rows = [torch.cat([p, p[-1:].expand(most - len(p), 3)]) for p in paths]
    return torch.stack(rows).double()


def place_at(paths: Paths, along: Tensor) -> Tensor:
    """The places so far along; ends where that is farther than paths go. Shape: (num_worlds, 3)."""
    row, line = _lines_at(paths, along)
    rest = (torch.minimum(along, paths.lengths) - paths.along[row, line])[:, None]
    return paths.points[row, line] + rest * paths.directions[row, line]


def direction_at(paths: Paths, along: Tensor) -> Tensor:
    """Unit vectors in which paths go on there. Shape: (num_worlds, 3)."""
    return paths.directions[_lines_at(paths, along)]


def nearest(paths: Paths, position: Tensor, first: Tensor, last: Tensor) -> Tensor:
    """How far along the place is that is nearest, of a part of each path.

    Args:
        paths: The paths.
        position: To which. Shape: (num_worlds, 3).
        first: Where the part begins, along each path. Shape: (num_worlds,).
        last: Where it ends; not before it begins.
    """
    low = torch.maximum(paths.along[:, :-1], first[:, None])
    high = torch.minimum(paths.along[:, 1:], last[:, None])
    away = position[:, None] - paths.points[:, :-1]
    reach = (away * paths.directions).sum(-1) + paths.along[:, :-1]
    found = torch.minimum(torch.maximum(reach, low), high)
    rest = (found - paths.along[:, :-1])[..., None] * paths.directions
    distance = (away - rest).norm(dim=-1).masked_fill(low > high, torch.inf)
    return found.gather(1, distance.argmin(1, keepdim=True))[:, 0]


def distance_from(paths: Paths, position: Tensor) -> Tensor:
    """From places to the nearest points of whole paths. Shape: (num_worlds,)."""
    along = nearest(paths, position, torch.zeros_like(paths.lengths), paths.lengths)
    return (position - place_at(paths, along)).norm(dim=-1)


def _lines_at(paths: Paths, along: Tensor) -> tuple[Tensor, Tensor]:
    """Row and number of the line on which places so far along are, of two the later one."""
    line = (paths.along[:, 1:-1] <= along[:, None]).sum(-1)
    return torch.arange(len(line), device=line.device), line
