import numpy as np
import pytest

from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks.pillars import field

SETTINGS = PillarsSettings(spread=3.0, density=0.34, width=1.2)
"""Two pillars a row, seven lanes; drone and pillars touch up to 1 m."""


def test_lanes_are_a_step_apart_and_within_the_field():
    assert field.lanes(SETTINGS).tolist() == [-3, -2, -1, 0, 1, 2, 3]
    assert field.lanes(SETTINGS.replace(step_length=0.7)).tolist() == pytest.approx(
        [-2.8, -2.1, -1.4, -0.7, 0, 0.7, 1.4, 2.1, 2.8]
    )


def test_a_lane_is_open_where_no_pillar_of_the_row_is_touched():
    rows = np.array([[0.5, 0.5], [-1.0, 2.0], [-3.0, 3.0]])
    opened = [field.lanes(SETTINGS)[row].tolist() for row in field.is_open(SETTINGS, rows)]
    # a pillar at -1 touches who is at -2, -1 or 0: 1 m is still a touch
    assert opened == [[-3, -2, -1, 2, 3], [-3], [-1, 0, 1]]


def test_fields_that_no_path_crosses_are_never_made():
    dense = PillarsSettings(spread=3.0, density=1.2, width=1.2)  # seven pillars in six metres
    drawn = field.draw_rows(dense, np.random.RandomState(0), 500)
    closed = ~field.is_open(dense, drawn).any(-1)
    assert 50 < closed.sum() < 480  # many rows are closed as they come
    random_state = np.random.RandomState(1)
    made = np.concatenate([field.draw_field(dense, random_state) for _ in range(200)])
    assert field.is_open(dense, made).any(-1).all() and made.shape == (800, dense.row_size)


def test_open_rows_are_as_they_are_drawn_and_each_world_repeats_its_own():
    first, again = (field.draw_field(SETTINGS, np.random.RandomState(3)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    drawn = field.draw_rows(SETTINGS, np.random.RandomState(3), SETTINGS.num_rows)
    is_open = field.is_open(SETTINGS, drawn).any(-1)
    assert is_open.any()
    np.testing.assert_array_equal(first[is_open], drawn[is_open])
    assert np.abs(first).max() <= SETTINGS.spread


def test_a_field_that_is_never_open_is_an_error_and_no_endless_loop(monkeypatch):
    monkeypatch.setattr(field, "is_open", lambda _, rows: np.zeros((len(rows), 7), bool))
    monkeypatch.setattr(field, "MOST_TRIES", 5)
    with pytest.raises(RuntimeError, match="5 drawings"):
        field.draw_field(SETTINGS, np.random.RandomState(0))
