"""Bars, pixel by pixel."""

import dataclasses

import numpy as np
import pytest

from drone_rl.report.indicator import HEIGHT, ROW, indicator
from drone_rl.report.palette import CHOSEN, MUTED
from drone_rl.words.actions import MOVES, ShownActions

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
    turned = dataclasses.replace(MOVES, names=MOVES.names[::-1], arrows=MOVES.arrows[::-1])
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
