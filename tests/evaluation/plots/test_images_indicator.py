"""Bars, pixel by pixel."""

import dataclasses

import numpy as np
import pytest

from drone_rl.evaluation.plots.images import CHOSEN, HEIGHT, MUTED, ROW, indicator
from drone_rl.sim.vocabulary import SHOWN_MOVES, ShownActions

FIVE = ShownActions(
    ("up", "down", "left", "right", "stay"),
    (2, 0, 4, 1, 3),
    ((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0)),
    ((0, 0, 0),) * 5,
)


def pixels(picture, color):
    return (np.asarray(picture) == color).all(-1)


@pytest.mark.parametrize("chosen", [0, 1, 2])
def test_bars_are_as_long_as_they_are_probable_and_the_chosen_one_is_red(chosen):
    def count(probabilities, color):
        return int(pixels(indicator(probabilities, chosen, 300), color).sum())

    sure = [0.0, 0.0, 0.0]
    sure[chosen] = 1.0
    half = [0.5 * p for p in sure]
    assert count(sure, CHOSEN) == pytest.approx(2 * count(half, CHOSEN), rel=0.1)
    assert count(sure, MUTED) < count([1 - p for p in sure], MUTED)


@pytest.mark.parametrize(("chosen", "where"), [(1, "left"), (2, "right"), (0, "middle")])
def test_bars_point_where_the_actions_do(chosen, where):
    rows, columns = pixels(indicator([0.9, 0.9, 0.9], chosen, 300), CHOSEN).nonzero()
    if where == "middle":
        assert abs(columns.mean() - 150) < 1 and np.ptp(rows) > np.ptp(columns)
    else:
        assert (columns.max() < 150) == (where == "left") and np.ptp(columns) > np.ptp(rows)


def test_where_they_stand_in_the_file_does_not_matter():
    turned = dataclasses.replace(
        SHOWN_MOVES, names=SHOWN_MOVES.names[::-1], arrows=SHOWN_MOVES.arrows[::-1]
    )
    here = pixels(indicator([0.2, 0.5, 0.3], 1, 300), CHOSEN)
    there = pixels(indicator([0.3, 0.5, 0.2], 1, 300, turned), CHOSEN)
    assert np.array_equal(here, there)


def test_other_actions_have_a_row_each_those_to_the_left_first():
    picture = indicator([0.0, 0.1, 0.6, 0.2, 0.1], 2, 300, FIVE)
    assert picture.size == (300, 5 * ROW + 4) and picture.height != HEIGHT
    rows, columns = pixels(picture, CHOSEN).nonzero()
    assert rows.max() < ROW + 4  # left is the first
    assert np.ptp(columns) == pytest.approx(0.6 * 144, abs=1)
    others, _ = pixels(picture, MUTED).nonzero()
    assert others.min() > ROW


def spans(picture, color):
    """First and last row and column of a colour."""
    rows, columns = pixels(picture, color).nonzero()
    return rows.min(), rows.max(), columns.min(), columns.max()


@pytest.mark.parametrize(
    ("chosen", "expected"),
    [
        (1, (58, 68, 98, 142)),  # left: half of 88 pixels, from 8 beside the middle
        (2, (58, 68, 158, 202)),
        (0, (38, 68, 145, 155)),  # ahead: half of 60
    ],
)
def test_arrows_by_the_pixel(chosen, expected):
    assert spans(indicator([0.5, 0.5, 0.5], chosen, 300), CHOSEN) == expected


@pytest.mark.parametrize("chosen", [0, 1, 2])
def test_an_arrow_of_nothing_is_still_there(chosen):
    low, high, first, last = spans(indicator([0.0, 0.0, 0.0], chosen, 300), CHOSEN)
    assert (high - low, last - first) == {0: (1, 10), 1: (10, 1), 2: (10, 1)}[chosen]


def test_rows_by_the_pixel():
    picture = indicator([0.0, 0.25, 0.5, 0.25, 0.0], 2, 300, FIVE)
    assert spans(picture, CHOSEN) == (4, 16, 150, 222)  # half of 144
    rows, columns = pixels(picture, MUTED).nonzero()
    widths = [np.ptp(columns[(rows >= 18 * i + 4) & (rows <= 18 * i + 16)]) for i in range(1, 5)]
    assert widths == [1, 1, 36, 36]  # up, stay, down and right, in the order (2, 0, 4, 1, 3)
