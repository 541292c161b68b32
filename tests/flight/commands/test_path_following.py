import pytest
import torch

from drone_rl.flight.commands import path_following as of


def rows(*values):
    return torch.tensor(values, dtype=torch.float64)


CORNER = rows([[0, 0, 1], [4, 0, 1], [4, 3, 1]], [[0, 0, 0], [0, 0, 2], [0, 0, 2]])
"""Four metres ahead and three to the left; two metres up, the end of which is repeated."""


@pytest.fixture
def paths():
    return of.make_paths(CORNER)


def test_lengths_and_directions(paths):
    assert paths.along.tolist() == [[0, 4, 7], [0, 2, 2]]
    assert paths.lengths.tolist() == [7, 2]
    assert paths.directions.tolist() == [[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0, 0, 0]]]
    assert paths.ends.tolist() == [[4, 3, 1], [0, 0, 2]]


def test_places_along(paths):
    assert of.place_at(paths, rows(5, 1.5)).tolist() == [[4, 1, 1], [0, 0, 1.5]]
    assert of.place_at(paths, rows(0, 9)).tolist() == [[0, 0, 1], [0, 0, 2]]
    assert of.place_at(paths, rows(99, 2)).tolist() == [[4, 3, 1], [0, 0, 2]]


def test_of_a_corner_the_later_direction_counts(paths):
    assert of.direction_at(paths, rows(4, 0)).tolist() == [[0, 1, 0], [0, 0, 1]]
    assert of.direction_at(paths, rows(3.9, 1)).tolist() == [[1, 0, 0], [0, 0, 1]]


def test_the_nearest_place_of_a_part(paths):
    position = rows([3.5, 2, 1], [1, 1, 1.25])
    whole = of.nearest(paths, position, rows(0, 0), paths.lengths)
    assert whole.tolist() == [6, 1.25]
    part = of.nearest(paths, position, rows(0, 1.5), rows(3, 2))
    assert part.tolist() == [3, 1.5]
    point = of.nearest(paths, position, rows(5, 2), rows(5, 2))
    assert point.tolist() == [5, 2]


def test_the_nearest_place_is_never_outside_the_part(paths):
    """The corner, 4 m along, is nearer than all of the part from 5 m to 6 m."""
    position = rows([4, 0.1, 1], [0, 0, 0])
    assert of.nearest(paths, position, rows(5, 1), rows(6, 2)).tolist() == [5, 1]


def test_a_part_keeps_to_one_way_through_a_crossing():
    """There and back again: the same place is 2 m and 8 m along."""
    paths = of.make_paths(rows([[0, 0, 0], [5, 0, 0], [0, 0, 0]]))
    position = rows([2, 0.1, 0])
    assert of.nearest(paths, position, rows(1), rows(4)).tolist() == [2]
    assert of.nearest(paths, position, rows(6), rows(9)).tolist() == [8]


def test_distances(paths):
    assert of.distance_from(paths, rows([2, -1, 1], [3, 4, 1])).tolist() == [1, 5]
    assert of.distance_from(paths, rows([-3, -4, 1], [0, 3, 6])).tolist() == [5, 5]
