import itertools

import numpy as np
import pytest
import torch

from drone_rl.config import PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.tasks import pillars_lanes
from drone_rl.sim.tasks.pillars import EndReason, Pillars
from drone_rl.sim.tasks.pillars_lanes import Lanes

SETTINGS = PillarsSettings(num_rows=3, spread=4.0, density=0.4, width=1.2)
"""Three pillars per row and nine lanes; contact up to 1 m."""
LANES = Lanes(SETTINGS)


def fewest_turns(rows, y, next_row):
    """Return, by enumeration, the least lateral distance and the best lanes of the next row."""
    lanes = LANES.within_field()
    opened = [lanes[o] for o in LANES.is_open(rows[next_row:])]
    paths = [np.diff([y, *path]) for path in itertools.product(*opened)]
    total = [np.abs(path).sum() for path in paths]
    return min(total), {path[0] for path, t in zip(paths, total, strict=True) if t == min(total)}


def test_plan_has_the_fewest_turns():
    random_state = np.random.RandomState(0)
    for _ in range(60):
        rows = LANES.sample_field(random_state)
        y, row = float(random_state.randint(-4, 5)), random_state.randint(3)
        turn = LANES.first_sidestep(
            torch.from_numpy(rows)[None], torch.tensor([y]).double(), torch.tensor([row])
        )
        assert float(turn) in fewest_turns(rows, y, row)[1]


def test_plan_looks_beyond_the_next_row():
    # the nearest lanes are right, then far to the left
    rows = np.array([[0.2, 0.2, 0.2], [-2.0, -1.0, 1.2], [-2.0, -1.0, 1.2]])
    turn = LANES.first_sidestep(
        torch.from_numpy(rows)[None], torch.zeros(1).double(), torch.tensor([0])
    )
    total, best = fewest_turns(rows, 0.0, 0)
    assert (total, best) == (3.0, {2.0, 3.0}) and float(turn) in best


def test_plan_flies_straight_behind_the_last_row():
    rows = torch.zeros(1, 3, 3).double()
    assert LANES.first_sidestep(rows, torch.zeros(1).double(), torch.tensor([3])) == 0
    drone = torch.tensor([[SETTINGS.last_distance + 1.5, 0.0, 2.5]])
    assert LANES.fly_through(drone, rows, torch.tensor([[2]])) == Move.FORWARD


def test_plan_flies_straight_within_a_row():
    rows = torch.tensor([[[3.0, 3.0, 3.0], [0.0, 0.0, 0.0], [3.0, 3.0, 3.0]]]).double()
    drone = torch.tensor([[9.0, 0.0, 2.5], [11.0, 0.0, 2.5]])
    moves = LANES.fly_through(drone, rows.repeat(2, 1, 1), torch.tensor([[0], [1]]))
    assert moves[0] == Move.FORWARD and moves[1] in (Move.LEFT, Move.RIGHT)


def test_plan_crosses_every_field():
    random_state = np.random.RandomState(7)
    drawn = np.stack([LANES.sample_field(random_state) for _ in range(300)])
    dynamics = ComputerVision(SETTINGS.step_length)
    body = dynamics.start(torch.tensor([[0.0, 0.0, 2.5]]).double().repeat(300, 1))
    state = Pillars(SETTINGS).start(torch.from_numpy(drawn), body)
    for _ in range(SETTINGS.step_limit):
        on = (state.end_reason == 0).nonzero()[:, 0]
        if not len(on):
            break
        now = state[on]
        move = LANES.fly_through(now.drone, now.rows, now.next_row[:, None])
        state[on] = Pillars(SETTINGS).step(now, dynamics.step(now.body, move))[0]
    assert (state.end_reason == EndReason.FINISH_LINE).all()


NARROW = PillarsSettings(spread=3.0, density=0.34, width=1.2)
"""Two pillars per row and seven lanes; contact up to 1 m."""
NARROW_LANES = Lanes(NARROW)


def test_lanes_are_one_step_apart_within_the_field():
    assert NARROW_LANES.within_field().tolist() == [-3, -2, -1, 0, 1, 2, 3]
    assert Lanes(NARROW.replace(step_length=0.7)).within_field().tolist() == pytest.approx(
        [-2.8, -2.1, -1.4, -0.7, 0, 0.7, 1.4, 2.1, 2.8]
    )


def test_lane_is_open_without_contact():
    rows = np.array([[0.5, 0.5], [-1.0, 2.0], [-3.0, 3.0]])
    opened = [NARROW_LANES.within_field()[row].tolist() for row in NARROW_LANES.is_open(rows)]
    # a pillar at -1 blocks -2, -1 and 0, as 1 m is a contact
    assert opened == [[-3, -2, -1, 2, 3], [-3], [-1, 0, 1]]


def test_sampled_fields_are_crossable():
    dense = PillarsSettings(spread=3.0, density=1.2, width=1.2)  # seven pillars in 6 m
    drawn = np.random.RandomState(0).uniform(-3.0, 3.0, (500, dense.row_size))
    closed = ~Lanes(dense).is_open(drawn).any(-1)
    assert 50 < closed.sum() < 480  # many sampled rows are closed
    random_state = np.random.RandomState(1)
    made = np.concatenate([Lanes(dense).sample_field(random_state) for _ in range(200)])
    assert Lanes(dense).is_open(made).any(-1).all() and made.shape == (800, dense.row_size)


def test_open_rows_are_kept_and_fields_are_seeded():
    first, again = (NARROW_LANES.sample_field(np.random.RandomState(3)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    drawn = np.random.RandomState(3).uniform(
        -NARROW.spread, NARROW.spread, (NARROW.num_rows, NARROW.row_size)
    )
    is_open = NARROW_LANES.is_open(drawn).any(-1)
    assert is_open.any()
    np.testing.assert_array_equal(first[is_open], drawn[is_open])
    assert np.abs(first).max() <= NARROW.spread


def test_field_without_open_lanes_raises(monkeypatch):
    monkeypatch.setattr(Lanes, "is_open", lambda _, rows: np.zeros((len(rows), 7), bool))
    monkeypatch.setattr(pillars_lanes, "MOST_TRIES", 5)
    with pytest.raises(RuntimeError, match="5 samples; lower the density"):
        NARROW_LANES.sample_field(np.random.RandomState(0))


def test_the_nearest_lane_of_a_drone_between_lanes_is_one_of_the_field():
    """No lane a whole number of steps from y = 0.5 m is open; that at 0 m is."""
    rows, y = torch.tensor([[-1.5, 1.5]]).double(), torch.tensor([0.5]).double()
    offset, _ = NARROW_LANES.nearest(rows, y)
    assert offset.tolist() == [-0.5]
