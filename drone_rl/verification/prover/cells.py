"""All places of one cube, as a row of cells in each of which its picture stays the same.

Between two cells lies a band, no wider than rounding errors, in which pixels that change do so one
after the other, each once: every operation by which the renderer places them rounds without turning
an order round. So the pictures of a band are found by halving it until neighbours are equal. Cells
and bands alternate: index 0 is a cell, 1 a band, and so on; the last is a cell.
"""

import copy
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cube_images import Eye

NARROWER = 8
"""A renderer that is asked shows its bands: by so much they are narrower than rounding allows."""
SLIVER = 1e-9
"""Metres of a cell beside a band that are enough to look at; bands stand farther apart."""


class Renderer(Protocol):
    """Shows one cube at one distance."""

    def look(self, left: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Its pictures, so many metres to the left. Shape: (N,) to (N, height, width, 3)."""
        ...

    def read(self, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """What each pixel shows of it, see `Eye.faces`. Shape: (N, height, width)."""
        ...


class Cells:
    """The cells of one cube at one distance ahead, from the right to the left."""

    def __init__(
        self,
        eye: Eye,
        ahead: float,
        lowest: float,
        highest: float,
        renderer: Renderer | None = None,
    ) -> None:
        """Finds them.

        Args:
            eye: The camera.
            ahead: Metres from it to the cube's centre.
            lowest: The same to the left, where the first cell begins.
            highest: Where the last one ends.
            renderer: Shows what there is within bands; without it, what is on either side.

        Raises:
            InputError: The renderer shows something else than the closed form.
        """
        if eye.grazed(ahead).any():
            raise InputError(
                f"{ahead} m ahead a row of pixels just grazes the edge of a cube, so that it is "
                "left to rounding what it shows; change task.first_distance a little"
            )
        bands, between = _bands(eye, ahead, lowest, highest, NARROWER), None
        if renderer is not None:
            between = _within(bands, eye, ahead, renderer)
            if between is None:
                bands = _bands(eye, ahead, lowest, highest, 1)
                between = _within(bands, eye, ahead, renderer)
            if between is None:
                raise InputError(
                    "the renderer draws another picture than the closed form beside a border, so "
                    "nothing can be proved of it; prove the policy in the default world"
                )
        self.limits = _limits(bands, lowest, highest)
        """Where each begins, and where the last one ends, metres to the left of the camera."""
        pure = eye.faces(ahead, _middles(self.limits))
        between = [pure[:0]] * len(bands) if between is None else between
        parts, begins = [pure[:1]], [0]
        for inner, after in zip(between, pure[1:], strict=True):
            begins += [begins[-1], begins[-1] + 1 + len(inner)]
            parts += [inner, after[None]]
        self.pictures = np.concatenate(parts)
        """What each pixel shows in the different pictures. Shape: (pictures, height, width)."""
        self.first = np.array(begins)
        """Of the pictures that each cell or band may show."""
        self.last = np.array([begins[min(i + i % 2, len(begins) - 1)] for i in range(len(begins))])
        """The last of them."""

    def __len__(self) -> int:
        """How many cells and bands there are."""
        return len(self.limits) - 1

    def between(self, lowest: float, highest: float) -> "Cells":
        """Those alone that an interval reaches into, metres to the left of the camera."""
        (first,), (last,) = self.span(np.array([lowest]), np.array([highest]))
        first, last = first - first % 2, last + last % 2  # from a cell to a cell
        some = copy.copy(self)
        some.limits = self.limits[first : last + 2]
        begin, end = self.first[first], self.last[last]
        some.pictures = self.pictures[begin : end + 1]
        some.first = self.first[first : last + 1] - begin
        some.last = self.last[first : last + 1] - begin
        return some

    def span(self, lower: NDArray, upper: NDArray) -> tuple[NDArray, NDArray]:
        """Cells and bands that intervals reach into.

        Args:
            lower: Where they begin, metres to the left of the camera.
            upper: Where they end.

        Returns:
            Index of the first, and of the last.
        """
        first = np.searchsorted(self.limits, lower, side="right") - 1
        last = np.searchsorted(self.limits, upper, side="left") - 1
        return first.clip(0, len(self) - 1), last.clip(0, len(self) - 1)


def _bands(eye: Eye, ahead: float, lowest: float, highest: float, narrower: float) -> NDArray:
    """Where pictures change, from the first band that reaches into a range to the last."""
    places, errors = eye.borders(ahead)
    errors = errors / narrower + eye.rounding(places)
    starts, stops = _unite(places - errors, places + errors)
    return np.stack([starts, stops], -1)[(stops > lowest) & (starts < highest)]


def _limits(bands: NDArray, lowest: float, highest: float) -> NDArray[np.float64]:
    """Where cells and bands begin and end; the outermost cells are beside whole bands."""
    if len(bands):
        lowest, highest = min(lowest, bands[0, 0] - SLIVER), max(highest, bands[-1, 1] + SLIVER)
    return np.concatenate([[lowest], bands.reshape(-1), [highest]])


def _middles(limits: NDArray) -> NDArray[np.float64]:
    return (limits[0::2] + limits[1::2]) / 2


def _within(
    bands: NDArray, eye: Eye, ahead: float, renderer: Renderer
) -> list[NDArray[np.uint8]] | None:
    """The pictures inside each band but its neighbours', in order.

    None if a neighbour's picture is not yet seen as far inside of a band's ends as rounding may
    move a cube: then the bands are too narrow.
    """
    if not len(bands):
        return []
    low = bands[:, 0] + eye.rounding(bands[:, 0])
    high = bands[:, 1] - eye.rounding(bands[:, 1])
    middle, close = (low + high) / 2, (high - low) / 8
    # mostly it changes close to where it would without rounding: look there first
    left = np.stack([low, middle - close, middle + close, high], -1).astype(np.float32)
    drawn = _look(renderer, left)
    pure = eye.faces(ahead, _middles(_limits(bands, np.inf, -np.inf)))
    if (drawn[:-1, -1] != drawn[1:, 0]).any() or _differs(renderer, drawn, pure):
        return None
    band, found = np.arange(len(bands)), []
    while True:
        row, k = np.nonzero((drawn[:, 1:] != drawn[:, :-1]).any((2, 3, 4)))
        band, a, b = band[row], left[row, k], left[row, k + 1]
        first, last = drawn[row, k], drawn[row, k + 1]
        is_done = np.nextafter(a, b) >= b
        found.append((band[is_done], b[is_done], last[is_done]))
        band, a, b, first, last = (v[~is_done] for v in (band, a, b, first, last))
        if not len(band):
            break
        middle = (a + b) / np.float32(2)
        # several places are looked at as fast as one
        between = np.stack([(a + middle) / 2, middle, (middle + b) / 2], -1)
        left = np.concatenate([a[:, None], between, b[:, None]], -1)
        drawn = np.concatenate([first[:, None], _look(renderer, between), last[:, None]], 1)
    band, where, pictures = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort((where, band))
    is_inner = band[order][1:] == band[order][:-1]  # the last of a band is that of its end
    inner = order[:-1][is_inner]
    counts = np.bincount(band[inner], minlength=len(bands))
    return np.split(renderer.read(pictures[inner]), np.cumsum(counts)[:-1])


def _look(renderer: Renderer, left: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Pictures at several places of each band. Shape: (bands, places) to (bands, places, ...)."""
    pictures = renderer.look(left.reshape(-1))
    return pictures.reshape(*left.shape, *pictures.shape[1:])


def _differs(renderer: Renderer, drawn: NDArray[np.uint8], pure: NDArray[np.uint8]) -> bool:
    """Whether anything but the closed form is drawn beside bands."""
    beside = np.concatenate([drawn[:, 0], drawn[-1:, -1]])
    return bool(len(beside)) and (renderer.read(beside) != pure).any()


def _unite(starts: NDArray, stops: NDArray) -> tuple[NDArray, NDArray]:
    """Intervals, sorted by their middles, with those that overlap made one."""
    if not len(starts):
        return starts, stops
    is_new = starts[1:] > np.maximum.accumulate(stops)[:-1] + 4 * SLIVER
    first = np.flatnonzero(np.concatenate([[True], is_new]))
    return np.minimum.reduceat(starts, first), np.maximum.reduceat(stops, first)
