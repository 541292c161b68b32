"""The positions of one cube at one distance, as intervals with a constant image.

Between two such cells lies a band, no wider than rounding errors, in which the pixels that change
do so one after the other, each once, because every operation of the renderer is monotone after
rounding. So bisection until neighbouring images are equal finds all images of a band. Cells and
bands alternate: index 0 is a cell, 1 a band, and so on; the last is a cell.
"""

import copy

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import unite
from drone_rl.verification.prover.cube_images import CameraModel, CubeView

NARROWER = 8  # factor by which bands are narrower if the renderer's images allow it
SLIVER = 1e-9  # metres. Smallest part of a cell next to a band; bands are further apart


class Cells:
    """The cells of one cube at one distance, from right to left."""

    def __init__(
        self,
        camera: CameraModel,
        ahead: float,
        lowest: float,
        highest: float,
        renderer: CubeView,
    ) -> None:
        """Find the cells of a cube whose centre is `ahead` metres from the camera.

        They reach at least from `lowest` to `highest`, metres to the left of the camera. The
        renderer renders the images within bands.

        Raises:
            InputError: The renderer contradicts the closed form.
        """
        if camera.grazed(ahead).any():
            raise InputError(
                f"at {ahead} m a row of pixels grazes the edge of a cube, so rounding decides what "
                "it shows; change task.first_distance a little"
            )
        for narrower in (NARROWER, 1):
            bands = _bands(camera, ahead, lowest, highest, narrower)
            between = _within(bands, camera, ahead, renderer)
            if between is not None:
                break
        else:
            raise InputError(
                "the renderer's image next to a border differs from the closed form, so nothing "
                "can be proved; prove the policy in the default environment"
            )
        self.limits = _limits(bands, lowest, highest)
        """Start of each cell and band, then the end of the last, metres left of the camera."""
        pure = _middle_faces(camera, ahead, self.limits)
        parts, begins = [pure[:1]], [0]
        for inner, after in zip(between, pure[1:], strict=True):
            begins += [begins[-1], begins[-1] + 1 + len(inner)]
            parts += [inner, after[None]]
        self.images = np.concatenate(parts)  # faces, (distinct images, height, width)
        self.first = np.array(begins)  # first and last possible image of each cell or band
        self.last = np.array([begins[min(i + i % 2, len(begins) - 1)] for i in range(len(begins))])

    def __len__(self) -> int:
        return len(self.limits) - 1

    def between(self, lowest: float, highest: float) -> "Cells":
        """Return the cells that an interval intersects, metres to the left of the camera."""
        (first,), (last,) = self.span(np.array([lowest]), np.array([highest]))
        first, last = first - first % 2, last + last % 2  # from a cell to a cell
        some = copy.copy(self)
        some.limits = self.limits[first : last + 2]
        begin, end = self.first[first], self.last[last]
        some.images = self.images[begin : end + 1]
        some.first = self.first[first : last + 1] - begin
        some.last = self.last[first : last + 1] - begin
        return some

    def span(self, lower: NDArray, upper: NDArray) -> tuple[NDArray, NDArray]:
        """Return the first and last cell or band that intervals of positions intersect."""
        first = np.searchsorted(self.limits, lower, side="right") - 1
        last = np.searchsorted(self.limits, upper, side="left") - 1
        return first.clip(0, len(self) - 1), last.clip(0, len(self) - 1)


def _bands(
    camera: CameraModel, ahead: float, lowest: float, highest: float, narrower: float
) -> NDArray:
    """Return the bands, narrowed, of the borders whose full bands intersect an interval. (N, 2)."""
    places, widest = camera.borders(ahead)
    errors = widest / narrower + camera.rounding(places)
    bands = unite(np.stack([places - errors, places + errors], -1), 4 * SLIVER)
    # the renderer is to confirm narrow bands, also of borders just outside of the interval
    aside = (widest - widest / narrower).max(initial=0.0)
    return bands[(bands[:, 1] + aside > lowest) & (bands[:, 0] - aside < highest)]


def _limits(bands: NDArray, lowest: float, highest: float) -> NDArray[np.float64]:
    """Return the borders of cells and bands; the outermost cells lie beside whole bands."""
    if len(bands):
        lowest, highest = min(lowest, bands[0, 0] - SLIVER), max(highest, bands[-1, 1] + SLIVER)
    return np.concatenate([[lowest], bands.reshape(-1), [highest]])


def _middle_faces(camera: CameraModel, ahead: float, limits: NDArray) -> NDArray[np.uint8]:
    """Return the faces in closed form in the middle of each cell."""
    return camera.faces(ahead, (limits[0::2] + limits[1::2]) / 2)


def _within(
    bands: NDArray, camera: CameraModel, ahead: float, renderer: CubeView
) -> list[NDArray[np.uint8]] | None:
    """Return the images inside each band, without those of the neighbouring cells.

    None if a band is too narrow: a point inside its end, by as much as rounding may move a cube,
    does not show the neighbouring cell's image.
    """
    if not len(bands):
        return []
    low = bands[:, 0] + camera.rounding(bands[:, 0])
    high = bands[:, 1] - camera.rounding(bands[:, 1])
    middle, close = (low + high) / 2, (high - low) / 8
    # most changes lie close to where they would be without rounding
    left = np.stack([low, middle - close, middle + close, high], -1).astype(np.float32)
    rendered = _render(renderer, left)
    pure = _middle_faces(camera, ahead, _limits(bands, np.inf, -np.inf))
    next_to = np.concatenate([rendered[:, 0], rendered[-1:, -1]])
    if (rendered[:-1, -1] != rendered[1:, 0]).any() or (renderer.read(next_to) != pure).any():
        return None
    band, changes = np.arange(len(bands)), []
    while True:
        row, k = np.nonzero((rendered[:, 1:] != rendered[:, :-1]).any((2, 3, 4)))
        band, a, b = band[row], left[row, k], left[row, k + 1]
        first, last = rendered[row, k], rendered[row, k + 1]
        is_done = np.nextafter(a, b) >= b
        changes.append((band[is_done], b[is_done], last[is_done]))
        band, a, b, first, last = (v[~is_done] for v in (band, a, b, first, last))
        if not len(band):
            break
        middle = (a + b) / np.float32(2)
        # several positions render as fast as one
        between = np.stack([(a + middle) / 2, middle, (middle + b) / 2], -1)
        left = np.concatenate([a[:, None], between, b[:, None]], -1)
        rendered = np.concatenate([first[:, None], _render(renderer, between), last[:, None]], 1)
    band, where, images = (np.concatenate(parts) for parts in zip(*changes, strict=True))
    order = np.lexsort((where, band))
    is_inner = band[order][1:] == band[order][:-1]  # the last of a band is that of its end
    inner = order[:-1][is_inner]
    counts = np.bincount(band[inner], minlength=len(bands))
    return np.split(renderer.read(images[inner]), np.cumsum(counts)[:-1])


def _render(renderer: CubeView, left: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Render several positions per band. Shape: (bands, places) to (bands, places, ...)."""
    images = renderer.render(left.reshape(-1))
    return images.reshape(*left.shape, *images.shape[1:])
