"""Forks by how they end, with intervals that a person can follow."""

import numpy as np
import pytest

from drone_rl.verification.prover.boxes import resolve_forks, volumes


def line(*intervals):
    return np.array(intervals, float).reshape(-1, 1, 2)


def sizes(parts):
    return {ending: float(volumes(boxes).sum()) for ending, boxes in parts.items()}


def test_all_ways_end_alike():
    settled, left = resolve_forks([line([0, 1]), line([3, 4])], {"won": line([0, 4])}, [], 1)
    assert sizes(settled) == {"won": 2.0}
    assert not len(left)


def test_where_ways_end_differently_nothing_is_decided():
    settled, left = resolve_forks(
        [line([0, 4])], {"won": line([0, 3]), "lost": line([2, 4])}, [], 1
    )
    assert sizes(settled) == {"won": 2.0, "lost": 1.0}
    assert left.tolist() == [[[2, 3]]]


def test_what_is_not_followed_to_its_end_is_undecided():
    settled, left = resolve_forks([line([0, 4])], {"won": line([0, 4])}, [line([1, 2])], 1)
    assert sizes(settled) == {"won": 3.0}
    assert left.tolist() == [[[1, 2]]]


def test_what_no_way_covers_is_undecided():
    """Nobody may claim an ending that was never reached."""
    settled, left = resolve_forks(
        [line([0, 4])], {"won": line([0, 3]), "lost": line([3, 3.5])}, [], 1
    )
    assert sizes(settled) == {"won": 3.0, "lost": 0.5}
    assert left.tolist() == [[[3.5, 4]]]


def test_forks_without_ways_are_undecided():
    settled, left = resolve_forks([line([0, 4])], {}, [], 1)
    assert settled == {} and left.tolist() == [[[0, 4]]]
    assert not len(resolve_forks([], {"won": line([0, 1])}, [], 1)[0]["won"])


@pytest.mark.parametrize("seed", range(5))
def test_against_every_point(seed):
    """In two dimensions, with random ways: each point is settled as its ways say, or not at all."""
    random = np.random.default_rng(seed)

    def some(count):
        ends = np.sort(random.integers(0, 8, (count, 2, 2)), -1).astype(float)
        ends[..., 1] += 0.5
        return ends

    forks = [np.array([[[i, i + 1], [0, 8.5]]], float) for i in range(8)]
    ways = {"a": np.concatenate([forks[0], some(6)]), "b": some(3), "c": some(2)}
    unknown = [some(2)]
    settled, left = resolve_forks(forks, ways, unknown, 2)
    points = random.random((400, 2)) * (8, 8.5)

    def has(boxes, point):
        return ((point > boxes[..., 0]) & (point < boxes[..., 1])).all(-1).sum()

    for point in points:
        ends = {name for name, boxes in ways.items() if has(boxes, point)}
        is_sure = len(ends) == 1 and not has(unknown[0], point)
        said = {name: int(has(boxes, point)) for name, boxes in settled.items()}
        assert said == {name: int(is_sure and name in ends) for name in said}
        assert has(left, point) == (not is_sure)
