"""Placements that the checker simulates: inside boxes, at borders, anywhere."""

import numpy as np
import pytest

from drone_rl.verification.checker.sampling import (
    ANYWHERE,
    BORDER,
    BORDER_OFFSET,
    CORNER_INSET,
    INSIDE,
    LIMIT,
    find,
    sample_anywhere,
    sample_borders,
    sample_inside,
    sample_limits,
    sample_placements,
)

LEFT, RIGHT = [[0.0, 2.0], [-1.0, 1.0]], [[2.0, 2.5], [-1.0, 1.0]]


BOXES = np.array([LEFT, RIGHT])


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def test_sample_inside(rng):
    points = sample_inside(BOXES, 20, rng)
    assert points.shape == (20, 2)
    assert sorted(points[:2].tolist()) == [[1.0, 0.0], [2.25, 0.0]]
    near, top = CORNER_INSET, 1 - CORNER_INSET
    ends = {(x, y) for low, high in ((0, 2), (2, 2.5)) for x in (low + near, high - near)
            for y in (-top, top)}  # fmt: skip
    assert {tuple(p) for p in points[2:10].tolist()} == ends
    held = (BOXES[:, None, :, 0] < points) & (points < BOXES[:, None, :, 1])
    assert held.all(2).any(0).all()


def test_sample_anywhere_is_uniform(rng):
    points, chosen = sample_anywhere(BOXES, 4000, rng)
    assert (chosen == 0).mean() == pytest.approx(0.8, abs=0.03)
    assert points.mean(0) == pytest.approx([1.25, 0.0], abs=0.06)


def test_sample_borders_on_both_sides(rng):
    won, lost = np.array([[[-1.0, 0.0], [-1.0, 1.0]]]), np.array([[[0.0, 1.0], [-1.0, 1.0]]])
    points = sample_borders([won, lost], 1.0, 60, rng)
    assert len(points) == 60
    assert points[::2, 0] == pytest.approx(-BORDER_OFFSET)
    assert points[1::2, 0] == pytest.approx(BORDER_OFFSET)
    assert (points[::2, 1] == points[1::2, 1]).all()
    assert len(sample_borders([np.concatenate([won, lost])], 1.0, 60, rng)) == 0  # all of one group


def test_sample_borders_across_a_thin_gap(rng):
    won, lost = np.array([[[-1.0, -1e-5]]]), np.array([[[1e-5, 1.0]]])
    gap = np.array([[[-1e-5, 1e-5]]])
    points = sample_borders([won, lost, gap], 1.0, 100, rng)
    assert points.min() < -5e-5 and points.max() > 5e-5
    assert 2 <= len(points) <= 8  # of one cube there are few


def test_sample_limits(rng):
    """The corners of the square, then points of which a coordinate at least is at a limit."""
    points = sample_limits(6.0, 2, 40, rng)
    end = 6.0 - CORNER_INSET
    assert points[:4].tolist() == [[-end, -end], [-end, end], [end, -end], [end, end]]
    is_at = np.abs(points) == end
    assert len(points) == 40 and is_at.any(1).all() and not is_at.all()
    assert (np.abs(points) <= end + CORNER_INSET).all()
    assert {tuple(row) for row in is_at.tolist()} == {(True, True), (True, False), (False, True)}
    assert len(sample_limits(6.0, 2, 3, rng)) == 3


def test_find():
    points = np.array([[2.2, 0.5], [0.5, 0.5], [2.0, 1.0]])
    assert find(BOXES, points).tolist() == [1, 0, 0]
    with pytest.raises(ValueError, match="no box holds"):
        find(BOXES, np.array([[3.0, 0.0]]))
    beside = np.array([[[0.0, 2.0], [-1.0, 1.0]], [[0.0, 2.0], [1.0, 3.0]]])
    assert find(beside, np.array([[1.0, 2.0], [1.0, 0.0]])).tolist() == [1, 0]


def test_sample_placements(parsed):
    placements = sample_placements(parsed, 400, np.random.default_rng(0))
    assert placements.points.shape == (400, 1)
    border = 1.65
    assert (placements.outcome[placements.points[:, 0] < border - 2e-5] == 0).all()
    assert (placements.outcome[placements.points[:, 0] > border + 2e-5] == 1).all()
    count = {why: int((placements.why == why).sum()) for why in (INSIDE, BORDER, LIMIT, ANYWHERE)}
    assert count[INSIDE] == 32  # a box of one cube needs no more than 4 times 4
    assert 2 <= count[BORDER] <= 12
    assert count[LIMIT] == 25 and count[ANYWHERE] >= 300  # a sixteenth; three quarters
    near = placements.points[placements.why == BORDER, 0]
    assert np.abs(near - border).max() < 2e-4


def test_outcomes_share_the_placements_inside_boxes(parsed):
    placements = sample_placements(parsed, 160, np.random.default_rng(0))
    inside = placements.outcome[placements.why == INSIDE]
    assert len(placements.points) == 160
    assert np.bincount(inside).tolist() == [10, 10]  # an eighth of all
