"""Exact, in any number of dimensions, down to the last bit of a border."""

from fractions import Fraction

import numpy as np
import pytest

from drone_rl.verification.checker.consistency import find_partition_error, volume

SQUARE = [
    [[-1.0, 0.0], [-1.0, 1.0]],
    [[0.0, 1.0], [-1.0, 0.25]],
    [[0.0, 1.0], [0.25, 1.0]],
]
"""Three rectangles that make up [-1, 1]^2."""


def random_partition(cubes, count, bound=6.0, seed=0):
    """Boxes, each cut in two at random until there are enough."""
    rng = np.random.default_rng(seed)
    boxes = np.full((1, cubes, 2), (-bound, bound))
    while len(boxes) < count:
        k = min(len(boxes), count - len(boxes))
        row, axis = np.arange(k), rng.integers(cubes, size=k)
        low, high = boxes[:k].copy(), boxes[:k].copy()
        size = low[row, axis, 1] - low[row, axis, 0]
        cut = low[row, axis, 0] + (0.1 + 0.8 * rng.random(k)) * size
        low[row, axis, 1] = high[row, axis, 0] = cut
        boxes = np.concatenate([boxes[k:], low, high])
    return boxes


def test_a_partition_by_hand():
    assert find_partition_error(np.array(SQUARE), 1.0) is None
    assert volume(np.array(SQUARE)) == 4


def test_volumes_are_exact():
    boxes = np.array([[[0.0, 0.1], [0.0, 0.1]], [[0.1, 0.3], [0.0, 1.0]]])
    tenth, wider = Fraction(0.1), Fraction(0.3)
    assert volume(boxes) == tenth**2 + (wider - tenth)
    assert volume(np.zeros((0, 2, 2))) == 0
    assert volume(np.array([[[5e-324, 1.0]]])) == 1 - Fraction(1, 2**1074)


@pytest.mark.parametrize(
    ("boxes", "counts"),
    [
        (SQUARE[:2], {0}),
        ([*SQUARE, SQUARE[0]], {2}),
        ([[[-1.0, 2.0], [-1.0, 1.0]]], {1}),  # beyond the border
        ([[[-1.0, 0.5], [-1.0, 1.0]], *SQUARE[1:]], {2}),
        ([[[-1.0, -0.5], [-1.0, 1.0]], *SQUARE[1:]], {0}),
        ([SQUARE[0], SQUARE[1], [[0.0, 1.0], [np.nextafter(0.25, 1), 1.0]]], {0}),
        ([SQUARE[0], SQUARE[1], [[0.0, 1.0], [np.nextafter(0.25, 0), 1.0]]], {2}),
        ([SQUARE[0], SQUARE[0]], {0, 2}),  # volumes add up
    ],
)
def test_a_misfit_is_found_with_its_place(boxes, counts):
    place, count = find_partition_error(np.array(boxes), 1.0) or pytest.fail(
        "taken for a partition"
    )
    assert count in counts
    assert (np.abs(place).max() > 1) == (count == 1)


def test_no_box_is_no_partition():
    place, count = find_partition_error(np.zeros((0, 3, 2)), 2.0) or ([], 1)
    assert (place, count) == ([0.0, 0.0, 0.0], 0)


@pytest.mark.parametrize(("cubes", "count"), [(1, 50), (2, 300), (3, 20_000), (5, 3000)])
def test_random_partitions_and_those_off_by_one_bit(cubes, count):
    boxes = random_partition(cubes, count)
    assert find_partition_error(boxes, 6.0) is None
    assert volume(boxes) == 12**cubes
    for change in (-1, 1):
        other = boxes.copy()
        other[7, 0, 0] = np.nextafter(other[7, 0, 0], change * np.inf)
        assert find_partition_error(other, 6.0) is not None
        assert volume(other) != 12**cubes
