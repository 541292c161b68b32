"""Sets of boxes and resolved forks: volumes by hand, membership by random points."""

import numpy as np
import pytest

from drone_rl.verification.prover import boxes as module
from drone_rl.verification.prover.boxes import (
    carve,
    complement,
    merge,
    resolve_forks,
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


def test_merge_keeps_the_set():
    random = np.random.default_rng(0)
    grid = boxes(*[[[i, i + 1], [j, j + 1]] for i in range(5) for j in range(5)])
    some = grid[random.random(25) < 0.6]
    points = random.random((500, 2)) * 5
    merged = merge(some)
    assert len(merged) < len(some)
    assert (holds(merged, points) == holds(some, points)).all()


@pytest.mark.parametrize(("cells", "most"), [(1_000_000, 1), (20, 1000), (20, 1)])
def test_union(cells, most, monkeypatch):
    """In one grid, in many small ones, and not at all where there would be too many."""
    monkeypatch.setattr(module, "AT_ONCE", cells)
    random = np.random.default_rng(1)
    some, points = random_boxes(random, 30), random.random((2000, 3)) * 7
    united = union(some, most)
    counts = holds(united, points)
    assert ((counts > 0) == (holds(some, points) > 0)).all()
    assert (counts.max() == 1) == (cells * most > 20)


@pytest.mark.parametrize("cells", [1_000_000, 20])
def test_complement(cells, monkeypatch):
    monkeypatch.setattr(module, "AT_ONCE", cells)
    random = np.random.default_rng(3)
    some, space = random_boxes(random, 10), boxes([[0, 7], [0, 7], [0, 7]])
    left, points = complement(some, space), random.random((2000, 3)) * 7
    assert left is not None
    assert (holds(left, points) == (holds(some, points) == 0)).all()
    assert volumes(left).sum() + volumes(union(some)).sum() == pytest.approx(343.0)


def test_complement_of_too_many_grids(monkeypatch):
    monkeypatch.setattr(module, "AT_ONCE", 20)
    some, space = random_boxes(np.random.default_rng(3), 10), boxes([[0, 7], [0, 7], [0, 7]])
    assert complement(some, space, most=2) is None
    assert complement(some[:0], space).tolist() == space.tolist()


def test_carve():
    random = np.random.default_rng(2)
    some = union(random_boxes(random, 10))
    hole = np.array([[1, 4], [2, 5], [0, 3]], float)
    inside, outside = carve(some, hole)
    points = random.random((2000, 3)) * 7
    in_hole = holds(hole[None], points)
    assert (holds(inside, points) == holds(some, points) * in_hole).all()
    assert (holds(outside, points) == holds(some, points) * (1 - in_hole)).all()


def test_unite():
    intervals = np.array([[0.0, 1.0], [0.5, 0.7], [1.0, 2.0], [2.5, 4.0]])
    assert unite(intervals, 0.0).tolist() == [[0.0, 2.0], [2.5, 4.0]]
    assert unite(intervals, 0.5).tolist() == [[0.0, 4.0]]
    assert unite(intervals[:0], 0.5).shape == (0, 2)


def test_unite_with_a_wide_interval():
    """In the order of their middles, the last one reaches back over the second to the first."""
    intervals = np.array([[0.0, 1.0], [1.5, 1.6], [0.5, 3.0]])
    assert unite(intervals, 0.0).tolist() == [[0.0, 3.0]]


def line(*intervals):
    return np.array(intervals, float).reshape(-1, 1, 2)


def sizes(parts):
    return {ending: float(volumes(boxes).sum()) for ending, boxes in parts.items()}


def test_uncovered_forks_are_undecided():
    settled, left = resolve_forks(
        [line([0, 4])], {"won": line([0, 3]), "lost": line([3, 3.5])}, [], 1
    )
    assert sizes(settled) == {"won": 3.0, "lost": 0.5}
    assert left.tolist() == [[[3.5, 4]]]


def test_forks_without_endings_are_undecided():
    settled, left = resolve_forks([line([0, 4])], {}, [], 1)
    assert settled == {} and left.tolist() == [[[0, 4]]]
    assert not len(resolve_forks([], {"won": line([0, 1])}, [], 1)[0]["won"])


@pytest.mark.parametrize("seed", range(5))
def test_resolve_forks_at_every_point(seed):
    """Each point is decided as its branches end, or not at all."""
    random = np.random.default_rng(seed)

    def some(count):
        ends = np.sort(random.integers(0, 8, (count, 2, 2)), -1).astype(float)
        ends[..., 1] += 0.5
        return ends

    forks = [np.array([[[i, i + 1], [0, 8.5]]], float) for i in range(8)]
    endings = {"a": np.concatenate([forks[0], some(6)]), "b": some(3), "c": some(2)}
    unknown = [some(2)]
    settled, left = resolve_forks(forks, endings, unknown, 2)
    points = random.random((400, 2)) * (8, 8.5)

    def has(boxes, point):
        return ((point > boxes[..., 0]) & (point < boxes[..., 1])).all(-1).sum()

    for point in points:
        ends = {name for name, boxes in endings.items() if has(boxes, point)}
        is_sure = len(ends) == 1 and not has(unknown[0], point)
        said = {name: int(has(boxes, point)) for name, boxes in settled.items()}
        assert said == {name: int(is_sure and name in ends) for name in said}
        assert has(left, point) == (not is_sure)
