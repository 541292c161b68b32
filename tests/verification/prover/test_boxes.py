"""Sets of boxes, with volumes by hand and membership by random points."""

import numpy as np
import pytest

from drone_rl.verification.prover import boxes as module
from drone_rl.verification.prover.boxes import (
    all_placements,
    blocks,
    carve,
    complement,
    cut,
    intersect,
    merge,
    ragged,
    union,
    unite,
    volumes,
)


def boxes(*given):
    return np.array(given, float)


def holds(some, points):
    """How many boxes hold each point."""
    inside = (points[:, None] > some[None, ..., 0]) & (points[:, None] < some[None, ..., 1])
    return inside.all(-1).sum(-1)


def random_boxes(random, count, n=3):
    ends = np.sort(random.integers(0, 6, (count, n, 2)), -1)
    ends[..., 1] += ends[..., 0] == ends[..., 1]
    return ends.astype(float)


def test_the_whole_and_its_volume():
    assert all_placements(6.0, 2).tolist() == [[[-6.0, 6.0], [-6.0, 6.0]]]
    assert volumes(all_placements(6.0, 2)).tolist() == [144.0]


def test_a_cut_goes_through_what_it_meets():
    below, above = cut(boxes([[0, 2], [0, 1]], [[3, 4], [0, 1]]), 0, 1.0)
    assert below.tolist() == [[[0, 1], [0, 1]]]
    assert above.tolist() == [[[1, 2], [0, 1]], [[3, 4], [0, 1]]]


def test_a_cut_beside_a_box_leaves_it_whole():
    below, above = cut(boxes([[0, 2]]), 0, 2.0)
    assert (below.tolist(), above.tolist()) == ([[[0, 2]]], [])


def test_neighbours_become_one():
    four = boxes([[0, 1], [0, 1]], [[1, 2], [0, 1]], [[0, 1], [1, 2]], [[1, 2], [1, 2]])
    assert merge(four).tolist() == [[[0, 2], [0, 2]]]


def test_boxes_that_only_touch_at_a_part_of_a_side_stay_apart():
    two = boxes([[0, 1], [0, 1]], [[1, 2], [0, 2]])
    assert len(merge(two)) == 2


def test_merging_changes_no_set():
    random = np.random.default_rng(0)
    grid = boxes(*[[[i, i + 1], [j, j + 1]] for i in range(5) for j in range(5)])
    some = grid[random.random(25) < 0.6]
    points = random.random((500, 2)) * 5
    merged = merge(some)
    assert len(merged) < len(some)
    assert (holds(merged, points) == holds(some, points)).all()


@pytest.mark.parametrize(("cells", "most"), [(1_000_000, 1), (20, 1000), (20, 1)])
def test_overlaps_are_united(cells, most, monkeypatch):
    """In one grid, in many small ones, and not at all where there would be too many."""
    monkeypatch.setattr(module, "AT_ONCE", cells)
    random = np.random.default_rng(1)
    some, points = random_boxes(random, 30), random.random((2000, 3)) * 7
    united = union(some, most)
    counts = holds(united, points)
    assert ((counts > 0) == (holds(some, points) > 0)).all()
    assert (counts.max() == 1) == (cells * most > 20)


@pytest.mark.parametrize("cells", [1_000_000, 20])
def test_what_boxes_leave_of_another(cells, monkeypatch):
    monkeypatch.setattr(module, "AT_ONCE", cells)
    random = np.random.default_rng(3)
    some, space = random_boxes(random, 10), boxes([[0, 7], [0, 7], [0, 7]])
    left, points = complement(some, space), random.random((2000, 3)) * 7
    assert left is not None
    assert (holds(left, points) == (holds(some, points) == 0)).all()
    assert volumes(left).sum() + volumes(union(some)).sum() == pytest.approx(343.0)


def test_what_would_take_too_long_is_left(monkeypatch):
    monkeypatch.setattr(module, "AT_ONCE", 20)
    some, space = random_boxes(np.random.default_rng(3), 10), boxes([[0, 7], [0, 7], [0, 7]])
    assert complement(some, space, most=2) is None
    assert complement(some[:0], space).tolist() == space.tolist()


def test_united_volume_by_hand():
    united = union(boxes([[0, 2], [0, 2]], [[1, 3], [1, 3]], [[0, 2], [0, 2]]))
    assert volumes(united).sum() == 7.0
    assert union(np.empty((0, 2, 2))).shape == (0, 2, 2)


def test_intersections_are_what_both_have():
    found = intersect(boxes([[0, 2], [0, 2]]), boxes([[1, 3], [1, 3]], [[2, 3], [0, 1]]))
    assert found.tolist() == [[[1, 2], [1, 2]]]


def test_carving_parts_the_inside_from_the_outside():
    random = np.random.default_rng(2)
    some = union(random_boxes(random, 10))
    hole = np.array([[1, 4], [2, 5], [0, 3]], float)
    inside, outside = carve(some, hole)
    points = random.random((2000, 3)) * 7
    in_hole = holds(hole[None], points)
    assert (holds(inside, points) == holds(some, points) * in_hole).all()
    assert (holds(outside, points) == holds(some, points) * (1 - in_hole)).all()


def test_rows_of_different_lengths():
    row, place = ragged(np.array([2, 0, 3]))
    assert row.tolist() == [0, 0, 2, 2, 2]
    assert place.tolist() == [0, 1, 0, 1, 2]


def test_blocks_of_a_grid_are_its_cells_once_each():
    mask = np.random.RandomState(0).rand(5, 4, 6) < 0.6
    seen = np.zeros(mask.shape, int)
    for (a, b), (c, d), (e, f) in blocks(mask):
        seen[a:b, c:d, e:f] += 1
    assert np.array_equal(seen, mask)
    assert blocks(np.zeros((2, 3), bool)).shape == (0, 2, 2)


def test_intervals_that_touch_are_united():
    intervals = np.array([[0.0, 1.0], [0.5, 0.7], [1.0, 2.0], [2.5, 4.0]])
    assert unite(intervals, 0.0).tolist() == [[0.0, 2.0], [2.5, 4.0]]
    assert unite(intervals, 0.5).tolist() == [[0.0, 4.0]]
    assert unite(intervals[:0], 0.5).shape == (0, 2)


def test_intervals_are_united_in_any_order():
    """By their middles, the widest is the last one, and begins before the first one ends."""
    intervals = np.array([[-1.0, 1.0], [1.2, 3.2], [0.2, 4.3]])
    assert unite(intervals, 0.0).tolist() == [[-1.0, 4.3]]
