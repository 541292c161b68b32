"""Bars, pixel by pixel."""

import dataclasses

import numpy as np
import pytest

from drone_rl.sim.vocabulary import SHOWN_MOVES, ShownActions
from drone_rl.trust.plots.images import ROW, indicator
from drone_rl.utils.palette import INK, MUTED

FIVE = ShownActions(
    ("up", "down", "left", "right", "stay"),
    (2, 0, 4, 1, 3),
    ((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0)),
    ((0, 0, 0),) * 5,
)


def bars(picture, color):
    """Where a color is, right of the names."""
    found = (np.asarray(picture) == color).all(-1)
    found[:, : picture.width // 2] = False
    return found


@pytest.mark.parametrize("chosen", [0, 1, 2])
def test_bars_are_as_long_as_they_are_probable_and_the_chosen_one_is_dark(chosen):
    def count(probabilities, color):
        return int(bars(indicator(probabilities, chosen, 300), color).sum())

    sure = [0.0, 0.0, 0.0]
    sure[chosen] = 1.0
    half = [0.5 * p for p in sure]
    assert count(sure, INK) == pytest.approx(2 * count(half, INK), rel=0.1)
    assert count(sure, MUTED) < count([1 - p for p in sure], MUTED)


def test_where_they_stand_in_the_file_does_not_matter():
    turned = dataclasses.replace(SHOWN_MOVES, names=SHOWN_MOVES.names[::-1], order=(1, 2, 0))
    here = bars(indicator([0.2, 0.5, 0.3], 1, 300), INK)
    there = bars(indicator([0.3, 0.5, 0.2], 1, 300, turned), INK)
    assert np.array_equal(here, there)


def test_actions_have_a_row_each_those_to_the_left_first():
    picture = indicator([0.0, 0.1, 0.6, 0.2, 0.1], 2, 300, FIVE)
    assert picture.size == (300, 5 * ROW + 4)
    rows, columns = bars(picture, INK).nonzero()
    assert rows.max() < ROW + 4  # left is the first
    assert np.ptp(columns) == pytest.approx(0.6 * 144, abs=1)
    others, _ = bars(picture, MUTED).nonzero()
    assert others.min() > ROW


def test_rows_by_the_pixel():
    picture = indicator([0.0, 0.25, 0.5, 0.25, 0.0], 2, 300, FIVE)
    rows, columns = bars(picture, INK).nonzero()
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (4, 16, 150, 222)  # of 144
    rows, columns = bars(picture, MUTED).nonzero()
    widths = [np.ptp(columns[(rows >= 18 * i + 4) & (rows <= 18 * i + 16)]) for i in range(1, 5)]
    assert widths == [1, 1, 36, 36]  # up, stay, down and right, in the order (2, 0, 4, 1, 3)


def test_a_bar_starts_right_of_the_longest_name():
    """Names of 24 letters are longer than half of a small image."""
    names = ("a" * 24, "left", "right")
    long = indicator([1.0, 0.5, 0.5], 0, 240, dataclasses.replace(SHOWN_MOVES, names=names))
    short = indicator([1.0, 0.5, 0.5], 0, 240)
    _, columns = bars(long, MUTED).nonzero()
    assert columns.min() > 160 and bars(short, MUTED).nonzero()[1].min() == 120
