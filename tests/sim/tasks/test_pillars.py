"""Rules, lanes, oracle and goals of the pillars: hand-made fields with rows at x = 9, 16, ..."""

import itertools

import numpy as np
import pytest
import torch

from drone_rl.config import DynamicsSettings, PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState, Quadrotor
from drone_rl.sim.tasks.common import Side
from drone_rl.sim.tasks.pillars import Pillars, PillarsEnd, RowGoals
from drone_rl.sim.tasks.pillars_lanes import Lanes
from tests.fake_flight import FLIGHT, Floating


@pytest.fixture
def settings():
    """Return settings with rows of two pillars at x = 9 and 16 and the finish line at x = 20."""
    return PillarsSettings(num_rows=2, density=0.125, width=1.2, reward={"progress": 1.0})


@pytest.fixture
def field(settings):
    """Return a factory of environments from the y of pillars by row, with a drone at rest."""

    def make(*rows, x=0.0, y=0.0):
        return Pillars(settings).start(torch.tensor([rows], dtype=torch.float64), body(x, y))

    return make


def body(x, y):
    """Return one drone at rest."""
    return BodyState.at_rest(torch.tensor([[x, y, 2.5]], dtype=torch.float64))


TASK = Pillars(PillarsSettings(num_rows=2, density=0.125, width=1.2))


L, A, R = Side.LEFT, Side.AHEAD, Side.RIGHT


FAR = (6.0, -6.0)
"""Positions of pillars that leave the center free."""


def fly(settings, state, *places):
    """Fly through positions; return the last state and the sum of rewards."""
    total = 0.0
    for x, y in places:
        state, reward = Pillars(settings).step(state, body(x, y))
        total += float(reward)
    return state, total


def test_pillars_are_in_rows(field):
    state = field((5.0, -5.0), (1.0, 2.0))
    assert state.places[0].tolist() == [[9, 5, 3], [9, -5, 3], [16, 1, 3], [16, 2, 3]]
    assert state.present.all() and not state.touched.any() and not state.reached.any()


def test_reward_is_progress_as_a_fraction_of_the_path(settings, field):
    state, reward = fly(settings, field(FAR, FAR), (1, 0))
    assert reward == 1 / 20 and state.end_reason == PillarsEnd.RUNNING
    state, reward = fly(settings, field(FAR, FAR), (1, 0), (1, 1), (1, 0))
    assert reward == 1 / 20  # no reward for lateral motion
    path = [(x, 0) for x in range(1, 21)]
    state, reward = fly(settings, field(FAR, FAR), *path)
    assert abs(reward - 1) < 1e-12 and state.end_reason == PillarsEnd.FINISH_LINE
    state, reward = fly(settings, field(FAR, FAR, x=19.5), (21.5, 0))
    assert abs(reward - 0.5 / 20) < 1e-12  # no reward beyond the finish line


def test_touching_a_pillar_ends_the_episode_with_a_penalty(settings, field):
    state, reward = fly(settings, field((0.9, -6.0), FAR, x=7.0), (8.0, 0.0))
    assert state.end_reason == PillarsEnd.PILLAR_TOUCHED and reward == 1 / 20
    assert state.touched[0].tolist() == [True, False, False, False]
    penalized = settings.replace(reward={"progress": 1.0, "contact": -3.0})
    assert fly(penalized, field((0.9, -6.0), FAR, x=7.0), (8.0, 0.0))[1] == 1 / 20 - 3


def test_contact_distance_is_one_meter(settings, field):
    for y, touches in ((1.0, True), (1.001, False), (-1.0, True), (-1.001, False)):
        state, _ = fly(settings, field((y, 6.0), FAR, x=8.5), (9.0, 0.0))
        assert bool(state.touched.any()) is touches


def test_long_moves_touch_pillars_on_their_path(settings, field):
    def touches(x, y, to_x, to_y):
        state, _ = fly(settings, field((0.0, 6.0), (6.0, 6.0), x=x, y=y), (to_x, to_y))
        return bool(state.touched[0, 0])

    assert touches(0, 0, 20, 0) and touches(20, 0, 0, 0)
    assert touches(9, -5, 9, 5) and not touches(7.9, -5, 7.9, 5)
    assert not touches(0, 0, 7.9, 0) and touches(0, 0, 8.0, 0)
    assert touches(9, 0, 9, 0) and not touches(7, 0, 7, 0)
    assert touches(7, -2, 9, 0) and not touches(6, -1, 8.5, 1.6)  # past the corner at (8, 1)
    assert not touches(6.5, 0, 8.9, 2.5)


def test_side_boundary_and_step_limit_end_the_episode(settings, field):
    state, _ = fly(settings, field(FAR, FAR, y=8.0), (0.0, 8.0))
    assert state.end_reason == PillarsEnd.RUNNING
    state, _ = fly(settings, state, (0.0, 8.5))
    assert state.end_reason == PillarsEnd.SIDE_BOUNDARY
    short = settings.replace(step_limit=20)
    state = field(FAR, FAR)
    state, _ = fly(short, state, *[(0.0, 0.0)] * 19)
    assert state.end_reason == PillarsEnd.RUNNING
    assert fly(short, state, (0.0, 0.0))[0].end_reason == PillarsEnd.STEP_LIMIT


def test_contact_precedes_finish_line_precedes_step_limit(settings, field):
    state, _ = fly(settings, field(FAR, (0.0, 6.0), x=14.0), (21.0, 0.0))
    assert state.end_reason == PillarsEnd.PILLAR_TOUCHED
    short = settings.replace(step_limit=20)
    state, _ = fly(short, field(FAR, FAR), *[(0.0, 0.0)] * 19, (20.0, 0.0))
    assert state.end_reason == PillarsEnd.FINISH_LINE


def test_lost_control_precedes_contact(settings, field):
    state = field((0.0, -6.0), FAR, x=7.0)
    lost = Floating(FLIGHT, None).start(torch.tensor([[8.5, 0.0, 2.5]]).double())
    state, _ = Pillars(settings).step(state, lost)
    assert state.end_reason == PillarsEnd.PILLAR_TOUCHED
    lost.lost[:] = True
    state, _ = Pillars(settings).step(field((0.0, -6.0), FAR, x=7.0), lost)
    assert state.end_reason == PillarsEnd.LOST_CONTROL and state.touched.any()


def next_row(state):
    return int(TASK.info(state)["next_row"])


def test_rows_are_passed_in_order(settings, field):
    state = field(FAR, FAR)
    assert next_row(state) == 0 and state.sides[0].tolist() == [A, -1]
    state, _ = fly(settings, state, (10.0, 0.0))
    assert next_row(state) == 0  # still next to the row
    state, _ = fly(settings, state, (10.1, 0.0))
    assert next_row(state) == 1 and state.sides[0].tolist() == [A, A]
    state, _ = fly(settings, state, (19.9, 0.0))
    assert state.reached[0].tolist() == [True, False]  # the last one is passed at the finish line
    state, _ = fly(settings, state, (20.0, 0.0))
    assert state.reached.all() and next_row(state) == 2


def test_nearest_lane_has_a_side_and_a_gap(field):
    # the pillar at 0.9 blocks lanes 0 and 1; -1 is nearer than 2, between pillars at 0.9 and -6.0
    state = field((0.9, -6.0), FAR)
    assert state.sides[0, 0] == R
    assert abs(float(state.noted[0, 0]) - (6.9 - 1.2)) < 1e-9
    # the pillar at 0.0 blocks lanes -1, 0, 1; 2 and -2 are tied, and the narrower gap's center wins
    state = field((0.0, 5.0), FAR)
    assert state.sides[0, 0] == L and abs(float(state.noted[0, 0]) - 3.8) < 1e-9
    state = field((0.0, -5.0), FAR)
    assert state.sides[0, 0] == R
    assert field((3.0, -3.0), FAR).sides[0, 0] == A
    # the field ends at 8, so a pillar at 7.5 leaves no lane on its left
    assert field((7.5, 5.4), FAR, y=7.0).sides[0, 0] == R


def test_next_target_is_the_nearest_pillar_of_the_next_row(field):
    assert TASK.edits.next_target(field((5.0, -2.0), FAR)) == 1
    assert TASK.edits.next_target(field((5.0, -2.0), FAR, y=4.0)) == 0
    state = field((5.0, -2.0), (1.0, 7.0))
    state.reached[:, 0] = True
    TASK.look_ahead(state)
    assert TASK.edits.next_target(state) == 2
    assert TASK.edits.next_offset(state)[0].tolist() == [16.0, 1.0, 0.0]
    state.reached[:] = True
    TASK.look_ahead(state)
    assert TASK.edits.next_target(state) == 4 and TASK.edits.next_offset(state).isnan().all()


def test_absent_pillars_are_ignored(field):
    state = TASK.edits.without_next(field((5.0, -2.0), FAR))
    assert state.present[0].tolist() == [True, False, True, True]
    assert TASK.edits.next_target(state) == 0
    assert TASK.edits.next_target(TASK.edits.without_next(state)) == 4


def test_grid_covers_the_field(settings):
    grid = Pillars(settings).edits.grid(3, 5)
    assert grid.forward.tolist() == [1.5, 5.25, 9.0]
    assert grid.lateral.tolist() == [8.0, 4.0, 0.0, -4.0, -8.0]


def test_needed_action_turns_away_from_a_pillar_ahead(settings):
    lateral = torch.tensor([3.0, 1.1, 1.0, 0.5, -0.5, -1.0, -1.1])
    offset = torch.stack([torch.full_like(lateral, 5.0), lateral, torch.zeros(7)], -1)
    task = Pillars(settings).edits
    f, left, right = Move.FORWARD, Move.LEFT, Move.RIGHT
    assert task.needed(offset).tolist() == [f, f, right, right, left, left, f]
    a, le, r = Side.AHEAD, Side.LEFT, Side.RIGHT
    assert task.stratum_at(offset).tolist() == [a, a, r, r, le, le, a]


def test_pillar_is_reached_when_passed_untouched(settings, field):
    task, target = Pillars(settings).edits, torch.tensor([0])
    state = field((5.0, -5.0), (5.0, -5.0), x=9.0)
    assert not task.is_behind(state, target) and not task.is_reached(state, target)
    state.body = body(9.5, 0.0)
    assert task.is_behind(state, target) and task.is_reached(state, target)
    state.touched[:, 1] = True
    assert task.is_behind(state, target) and not task.is_reached(state, target)


def test_classes_of_rows(settings):
    goals = RowGoals(
        reached=torch.tensor([[True, False]]),
        stratum=torch.tensor([[2, 1]]),
        world=torch.zeros(1, 4),
        gap=torch.tensor([[1.0, 9.0]]).double(),
    )
    found = {(by, value): of[0].tolist() for by, value, of in Pillars(settings).classes(goals)}
    assert found == {
        ("row", "first"): [True, False],
        ("row", "second"): [False, True],
        ("side", "left"): [False, False],
        ("side", "ahead"): [False, True],
        ("side", "right"): [True, False],
        ("gap", "0.8 to 1.8 m"): [True, False],
        ("gap", "1.8 to 3.8 m"): [False, False],
        ("gap", "more than 3.8 m"): [False, True],
    }


def test_goals_use_the_last_info(settings):
    info = {
        "passed": torch.tensor([[True, False]]),
        "side": torch.tensor([[2, -1]]),
        "gap": torch.tensor([[1.5, torch.nan]]).double(),
        "rows": torch.tensor([[[1.0, 2.0], [3.0, 4.0]]]),
    }
    goals = Pillars(settings).score(info)
    assert goals.reached.tolist() == [[True, False]] and goals.stratum.tolist() == [[2, -1]]
    assert goals.world.tolist() == [[1, 2, 3, 4]] and goals.gap[0, 0] == 1.5


def test_a_pillar_that_a_drone_bounces_off_within_a_step_is_touched():
    """It hits at x = 8.2 (0.5 m + 0.3 m from the middle) and is before x = 8.1 at both ends."""
    task, quadrotor = Pillars(), Quadrotor(DynamicsSettings(mode="simple_flight"))
    flying = quadrotor.start(torch.tensor([[8.09, 0.0, 2.5]]).double())
    flying.velocity[0, 0] = 4.0
    rows = torch.tensor([[[0.0, 4.0, 6.0, -6.0]] * 4]).double()
    state = task.start(rows, flying)
    after = quadrotor.step(flying, torch.tensor([0]), task.obstacles(state))
    assert float(after.position[0, 0]) < 8.1 and float(after.velocity[0, 0]) < 0
    state, reward = task.step(state, after)
    assert state.end_reason == PillarsEnd.PILLAR_TOUCHED
    assert state.touched[0].nonzero().tolist() == [[0]] and float(reward) < -0.49


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


def test_plan_flies_straight_within_a_row():
    rows = torch.tensor([[[3.0, 3.0, 3.0], [0.0, 0.0, 0.0], [3.0, 3.0, 3.0]]]).double()
    drone = torch.tensor([[9.0, 0.0, 2.5], [11.0, 0.0, 2.5]])
    moves = LANES.fly_through(drone, rows.repeat(2, 1, 1), torch.tensor([[0], [1]]))
    assert moves[0] == Move.FORWARD and moves[1] in (Move.LEFT, Move.RIGHT)


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


def test_the_nearest_lane_of_a_drone_between_lanes_is_one_of_the_field():
    """No lane a whole number of steps from y = 0.6 m is open; that at 0 m is, to the right."""
    task = Pillars(NARROW.replace(num_rows=1))
    state = task.start(torch.tensor([[[-1.5, 1.5]]]).double(), body(0.0, 0.6))
    assert state.sides.tolist() == [[R]] and state.noted.tolist() == [[pytest.approx(1.8)]]
