"""Where in the plane of its places the picture of one cube changes.

At D metres ahead of the camera and Y to its left, see `silhouettes`, these change it, with a the
slope of a column's rays to the left, b that of a row's upwards and h half a cube's edge:

- fronts begin and end at Y = a (D - h) - h and Y = a (D - h) + h;
- a side ends at Y = a (D + h) +- h, where a row sees its far edge;
- or at Y = a h / |b| +- h, where the row leaves it by its upper or lower edge before;
- a row sees nothing of the cube farther off than D = h / |b| + h: an upright border as long as the
  front is wide.
"""

import numpy as np
from numpy.typing import NDArray

from drone_rl.verification.prover.arrangement import SAME, Pieces, Window
from drone_rl.verification.prover.silhouettes import UNIT, Eye

_DIGITS = 14
"""Of slopes: those of a row above and one below are rounded otherwise."""


def find_borders(eye: Eye, window: Window) -> Pieces:
    """All of them within a rectangle; no two on one line overlap.

    Args:
        eye: The camera.
        window: Metres ahead of it, all more than half a cube's edge, and to its sides.
    """
    slopes, half = np.unique(eye.left), eye.half
    with np.errstate(divide="ignore"):
        leaves = half / np.unique(np.abs(eye.up).round(_DIGITS))
    last = leaves.max()
    aside = slopes[slopes != 0]
    outer = half * np.sign(aside)
    pieces = [
        _lines(slopes, -slopes * half - half, last + half),
        _lines(slopes, -slopes * half + half, last + half),
        _lines(aside, aside * half + outer, last - half),
        *_levels(aside, outer, leaves[np.isfinite(leaves)], half),
    ]
    slope, offset, begin, end = np.concatenate(pieces, 1)
    upright = [
        [leave + half, *span]
        for leave in leaves[np.isfinite(leaves)]
        for span in joined(np.stack([slopes * leave - half, slopes * leave + half], -1))
    ]
    return Pieces(slope, offset, begin, end, np.reshape(upright, (-1, 3))).clipped(window)


def doubtful_area(eye: Eye, pieces: Pieces, window: Window) -> float:
    """Square metres, at most, so near to a border that it may lie on its other side in float32.

    See `Eye.borders` and `Eye.grazed` for how near that is.
    """
    farthest = max(eye.farthest, window.farthest + 1.0)
    widest = max(eye.widest, window.sideways)

    def error(x: NDArray) -> NDArray:
        y = np.abs(pieces.slope * x + pieces.offset)
        return 16 * (y + eye.half) + 3 * np.abs(pieces.slope) * farthest + 3 * widest

    length = pieces.end - pieces.begin
    bands = (length * (error(pieces.begin) + error(pieces.end))).sum()
    _, low, high = pieces.upright.T
    return UNIT * float(bands + 2 * 32 * farthest * (high - low).sum())


def joined(spans: NDArray[np.float64]) -> list[list[float]]:
    """Spans that overlap or touch as one. Shape: (N, 2)."""
    found: list[list[float]] = []
    for low, high in spans[np.argsort(spans[:, 0])].tolist():
        if found and low <= found[-1][1] + SAME:
            found[-1][1] = max(found[-1][1], high)
        else:
            found.append([low, high])
    return found


def _lines(slope: NDArray, offset: NDArray, end: float) -> NDArray:
    """Lines from anywhere to x = end. Shape: (4, N)."""
    return np.stack([slope, offset, np.full_like(slope, -np.inf), np.full_like(slope, end)])


def _levels(aside: NDArray, outer: NDArray, leaves: NDArray, half: float) -> list[NDArray]:
    """The level borders; those of several rows at the same height are joined. Each: (4, 1)."""
    height = (aside[:, None] * leaves + outer[:, None]).reshape(-1)
    spans = np.stack([leaves - half, leaves + half], -1)[None].repeat(len(aside), 0).reshape(-1, 2)
    order = np.argsort(height)
    height, spans = height[order], spans[order]
    groups = np.split(np.arange(len(height)), np.flatnonzero(np.diff(height) > SAME) + 1)
    return [
        np.array([[0.0], [height[group[0]]], [begin], [end]])
        for group in groups
        if len(group)
        for begin, end in joined(spans[group])
    ]
