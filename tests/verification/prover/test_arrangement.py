"""Arrangements that can be counted and measured by hand."""

import numpy as np
import pytest

from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.arrangement import Pieces, Window, arrange

SQUARE = Window(0.0, 4.0, 2.0)


def pieces(*lines, upright=()):
    """Each line: slope, offset, begin, end."""
    slope, offset, begin, end = np.reshape(lines, (-1, 4)).T.astype(float)
    return Pieces(slope, offset, begin, end, np.reshape(upright, (-1, 3)).astype(float))


def cut(*lines, upright=(), window=SQUARE, most=1000):
    return arrange(pieces(*lines, upright=upright).clipped(window), window, most)


EVERYWHERE = (-np.inf, np.inf)


def test_a_cross_of_lines_through_one_point():
    found = cut((0, 0, *EVERYWHERE), (1, -2, *EVERYWHERE), (-1, 2, *EVERYWHERE))
    assert len(found.cells) == 6
    assert sorted(found.areas()) == [2, 2, 2, 2, 4, 4]


def test_clipping():
    found = pieces(
        (1, 0, *EVERYWHERE), (1, 9, *EVERYWHERE), (0, 2, 1, 3), (0, 1, 1, 9), (-2, 0, 3, 9),
        upright=[(0, -1, 1), (3, -9, 0), (3, 2, 5), (5, -1, 1)],
    ).clipped(SQUARE)  # fmt: skip
    assert np.stack([found.slope, found.offset, found.begin, found.end], -1).tolist() == [
        [1, 0, 0, 2], [0, 1, 1, 4],
    ]  # fmt: skip
    assert found.upright.tolist() == [[3, -2, 0]]


def test_inner_point_of_a_concave_cell():
    """A level piece with an upright one at its end: three quarters of the square are one cell."""
    found = cut((0, 0, 0, 2), upright=[(2, 0, 2)])
    assert sorted(found.areas()) == [4, 12]
    large, small = np.argsort(-found.areas())
    points = found.inner_points()
    assert points[small].tolist() == [1, 1]
    assert found.locate(points).tolist() == [0, 1]
    x, y = points[large]
    assert not (x < 2 and y > 0)


def test_inner_point_of_a_notched_cell():
    """A notch that reaches into the triangle at the cell's first corner."""
    found = cut((0, -1.9, 0.05, 4), (0, -1.8, 0.05, 4), upright=[(0.05, -1.9, -1.8)])
    points = found.inner_points()
    assert sorted(found.locate(points)) == [0, 1]
    assert sorted(found.areas()) == pytest.approx([3.95 * 0.1, 16 - 3.95 * 0.1])


def test_areas_above_a_line():
    found = cut((1, -2, *EVERYWHERE))  # two triangles of 8
    upper, lower = found.locate(np.array([[1.0, 1.0], [3.0, -1.0]]))
    assert found.areas()[[upper, lower]].tolist() == [8, 8]
    assert found.areas(above=0.0)[[upper, lower]].tolist() == [6, 2]
    assert found.areas(above=1.0)[[upper, lower]].tolist() == [3.5, 0.5]
    assert found.areas(above=-5.0)[[upper, lower]].tolist() == [8, 8]
    assert found.areas(above=5.0).tolist() == [0, 0]


def test_area_of_a_small_cell():
    found = cut((0, 1, *EVERYWHERE), (0, 1 + 2.0**-26, *EVERYWHERE))
    assert found.areas().min() == pytest.approx(2.0**-24, rel=1e-9)


def test_nearly_equal_points_are_merged():
    third = 1 / 3
    lines = [(s, -s * third - 1, *EVERYWHERE) for s in (-3, -1, 0.7, 2)]  # all through one point
    assert len(cut(*lines).cells) == 8


def test_outlines_skip_straight_corners():
    found = cut((0, 0, *EVERYWHERE), (0, 1, *EVERYWHERE), upright=[(2, -2, 2)])
    points = found.inner_points()
    outlines = found.outlines((points[:, 1] > 0).astype(int))
    assert sorted(label for label, _ in outlines) == [0, 1]
    upper = next(outline for label, outline in outlines if label == 1)
    assert sorted(upper.tolist()) == [[0, 0], [0, 2], [4, 0], [4, 2]]
    x, y = upper.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2 == 8  # it lies to the left


def test_too_many_cells_are_refused():
    lines = [(0, y, *EVERYWHERE) for y in np.linspace(-1.9, 1.9, 30)]
    lines += [(1, y, *EVERYWHERE) for y in np.linspace(-5, 1, 30)]
    with pytest.raises(InputError, match=r"more than 20 cells .*most_cells"):
        cut(*lines, most=20)


def test_a_loop_is_a_cell_with_another_around_it():
    loop = [(0, -1, 1, 3), (0, 1, 1, 3)]
    found = cut(*loop, upright=[(1, -1, 1), (3, -1, 1)])
    assert sorted(found.areas()) == [4, 12]
    assert len(found.outlines(found.areas().argsort())) == 3  # two of the cell around
