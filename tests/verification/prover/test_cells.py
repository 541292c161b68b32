"""Cells and bands of a tiny camera, by hand."""

import numpy as np
import pytest

from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cells import Cells, _bands
from drone_rl.verification.prover.cube_images import CameraModel

TINY = CameraModel(
    left=np.array([1.0, -1.0]), up=np.array([0.0]), half=1.0, farthest=40.0, widest=20.0, bound=6.0
)


class ShiftedRenderer:
    """A renderer with an error in each pixel: colors are faces."""

    def __init__(self, error=(0.0, 0.0), ahead=4.0):
        self.error, self.ahead = error, ahead

    def render(self, left):
        faces = [
            TINY.faces(self.ahead, left.astype(float) + e)[..., k] for k, e in enumerate(self.error)
        ]
        return np.stack(faces, -1)[..., None].repeat(3, -1)

    def read(self, images):
        return images[..., 0]


def test_cells_by_hand():
    """4 m ahead, images change 2, 4 and 6 m to either side."""
    cells = Cells(TINY, 4.0, -5.0, 5.0, ShiftedRenderer())
    middles = (cells.limits[1:] + cells.limits[:-1]) / 2
    assert middles[1::2].round(6).tolist() == [-4.0, -2.0, 2.0, 4.0]
    assert len(cells) == 9
    assert np.diff(cells.limits)[1::2].max() < 2e-5
    assert cells.images[:, 0].tolist() == [[0, 3], [0, 1], [0, 0], [1, 0], [2, 0]]
    assert cells.first.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4]
    assert cells.last.tolist() == [0, 1, 1, 2, 2, 3, 3, 4, 4]


def test_spans():
    cells = Cells(TINY, 4.0, -5.0, 5.0, ShiftedRenderer())
    first, last = cells.span(np.array([-5.0, -1.0, 2.0]), np.array([-4.5, 3.0, 5.0]))
    assert (first.tolist(), last.tolist()) == ([0, 4, 5], [0, 6, 8])


def test_images_within_a_band_are_found():
    """The pixel on the right changes late: at its borders there is an image of neither side."""
    both = CameraModel(**{**vars(TINY), "left": np.array([1.0, 1.0])})

    class LateRenderer(ShiftedRenderer):
        def render(self, left):
            faces = [both.faces(4.0, left.astype(float) - e)[..., :1] for e in (0.0, 1e-6)]
            return np.concatenate(faces, -1)[..., None].repeat(3, -1)

    cells = Cells(both, 4.0, 1.0, 3.0, LateRenderer())
    assert cells.images[:, 0].tolist() == [[0, 0], [1, 0], [1, 1]]
    assert (cells.first.tolist(), cells.last.tolist()) == ([0, 0, 2], [0, 2, 2])
    two = Cells(both, 4.0, 1.0, 5.0, LateRenderer())  # a band at 2 m and one at 4 m
    assert two.images[:, 0].tolist() == [[0, 0], [1, 0], [1, 1], [2, 1], [2, 2]]
    assert (two.first.tolist(), two.last.tolist()) == ([0, 0, 2, 2, 4], [0, 2, 2, 4, 4])


def test_a_small_rendering_error_widens_bands():
    narrow = np.diff(Cells(TINY, 4.0, 1.0, 3.0, ShiftedRenderer()).limits)[1]
    wide = np.diff(Cells(TINY, 4.0, 1.0, 3.0, ShiftedRenderer((4e-6, 4e-6))).limits)[1]
    assert wide > 2 * narrow


def test_a_large_rendering_error_is_refused():
    with pytest.raises(InputError, match="differs from the closed form"):
        Cells(TINY, 4.0, 1.0, 3.0, ShiftedRenderer((1e-3, 1e-3)))


def test_grazing_rows_are_refused():
    camera = CameraModel(**{**vars(TINY), "up": np.array([0.5])})
    with pytest.raises(InputError, match=r"at 3.0 m a row of pixels grazes"):
        Cells(camera, 3.0, -5.0, 5.0, ShiftedRenderer())


def test_between():
    whole = Cells(TINY, 4.0, -5.0, 5.0, ShiftedRenderer())
    some = whole.between(-0.7, 2.5)
    assert some.limits[0] <= -0.7 and some.limits[-1] >= 1.3
    assert 1 < len(some) < len(whole) and len(some) % 2 == 1
    (at,) = np.flatnonzero(whole.limits == some.limits[0])
    for k in range(len(some)):
        mine = some.images[some.first[k] : some.last[k] + 1]
        theirs = whole.images[whole.first[at + k] : whole.last[at + k] + 1]
        assert np.array_equal(mine, theirs)
    assert len(some.images) == some.last[-1] + 1


class Borders:
    """Borders at 1 and 5 m, each known up to 0.1 m; the faces are the positions themselves."""

    def borders(self, ahead):
        return np.array([1.0, 5.0]), np.array([0.1, 0.1])

    def rounding(self, places):
        return 0.0 * places

    def faces(self, ahead, positions):
        return positions


@pytest.mark.parametrize(
    ("lowest", "highest", "count"),
    [(0.0, 6.0, 2), (1.0, 5.0, 2), (1.05, 4.0, 1), (1.2, 4.95, 1), (1.2, 4.8, 0)],
)
def test_bands_at_the_ends_of_an_interval(lowest, highest, count):
    assert len(_bands(Borders(), 3.0, lowest, highest, 1.0)) == count
