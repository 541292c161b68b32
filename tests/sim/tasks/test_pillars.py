"""Hand-made fields with rows at x = 9, 16, ...; contact up to 1 m on each axis."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from drone_rl.config import CameraSettings, DynamicsSettings, PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState, Quadrotor
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import Pillars, as_task
from drone_rl.sim.tasks.common import Side, side_of
from drone_rl.sim.tasks.pillars import EndReason, RowGoals
from drone_rl.sim.tasks.pillars_lanes import Lanes, meets
from tests.fake_flight import FLIGHT, Floating


@pytest.fixture
def settings():
    """Return settings with rows of two pillars at x = 9 and 16 and the finish line at x = 20."""
    return PillarsSettings(num_rows=2, density=0.125, width=1.2, collision_penalty=0.0)


@pytest.fixture
def field(settings):
    """Return a factory of environments from the y of pillars by row, with a drone at rest."""

    def make(*rows, x=0.0, y=0.0):
        return Pillars(settings).start(torch.tensor([rows], dtype=torch.float64), body(x, y))

    return make


def body(x, y):
    """Return one drone at rest."""
    return BodyState.at_rest(torch.tensor([[x, y, 2.5]], dtype=torch.float64))


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


def test_enumeration_values_are_those_of_files():
    ends = (
        *("RUNNING", "FINISH_LINE", "PILLAR_TOUCHED", "SIDE_BOUNDARY", "STEP_LIMIT"),
        "LOST_CONTROL",
    )
    assert [(e.name, e.value) for e in EndReason] == [(n, i) for i, n in enumerate(ends)]
    assert [(s.name, s.value) for s in Side] == [("LEFT", 0), ("AHEAD", 1), ("RIGHT", 2)]


def test_pillars_are_in_rows(field):
    state = field((5.0, -5.0), (1.0, 2.0))
    assert state.pillars[0].tolist() == [[9, 5, 3], [9, -5, 3], [16, 1, 3], [16, 2, 3]]
    assert state.present.all() and not state.touched.any() and not state.passed.any()


def test_reward_is_progress_as_a_fraction_of_the_path(settings, field):
    state, reward = fly(settings, field(FAR, FAR), (1, 0))
    assert reward == 1 / 20 and state.end_reason == EndReason.RUNNING
    state, reward = fly(settings, field(FAR, FAR), (1, 0), (1, 1), (1, 0))
    assert reward == 1 / 20  # no reward for lateral motion
    path = [(x, 0) for x in range(1, 21)]
    state, reward = fly(settings, field(FAR, FAR), *path)
    assert abs(reward - 1) < 1e-12 and state.end_reason == EndReason.FINISH_LINE
    state, reward = fly(settings, field(FAR, FAR, x=19.5), (21.5, 0))
    assert abs(reward - 0.5 / 20) < 1e-12  # no reward beyond the finish line


def test_touching_a_pillar_ends_the_episode_with_a_penalty(settings, field):
    state, reward = fly(settings, field((0.9, -6.0), FAR, x=7.0), (8.0, 0.0))
    assert state.end_reason == EndReason.PILLAR_TOUCHED and reward == 1 / 20
    assert state.touched[0].tolist() == [True, False, False, False]
    penalized = settings.replace(collision_penalty=3.0)
    assert fly(penalized, field((0.9, -6.0), FAR, x=7.0), (8.0, 0.0))[1] == 1 / 20 - 3


def test_contact_distance_is_one_meter(settings, field):
    for y, touches in ((1.0, True), (1.001, False), (-1.0, True), (-1.001, False)):
        state, _ = fly(settings, field((y, 6.0), FAR, x=8.5), (9.0, 0.0))
        assert bool(state.touched.any()) is touches


def test_long_moves_touch_pillars_on_their_path(settings):
    pillars = torch.tensor([[[9.0, 0.0, 3.0]]]).double()

    def touches(x, y, to_x, to_y):
        at = [torch.tensor([[a, b, 2.5]]).double() for a, b in ((x, y), (to_x, to_y))]
        return bool(meets(settings.touch_distance, *at, pillars))

    assert touches(0, 0, 20, 0) and touches(20, 0, 0, 0)
    assert touches(9, -5, 9, 5) and not touches(7.9, -5, 7.9, 5)
    assert not touches(0, 0, 7.9, 0) and touches(0, 0, 8.0, 0)
    assert touches(9, 0, 9, 0) and not touches(7, 0, 7, 0)
    assert touches(7, -2, 9, 0) and not touches(6, -1, 8.5, 1.6)  # past the corner at (8, 1)
    assert not touches(6.5, 0, 8.9, 2.5)


@given(st.tuples(*[st.floats(-4, 4)] * 4))
@hypothesis_settings(max_examples=200, deadline=None)
def test_path_contact_equals_dense_sampling(path):
    settings = PillarsSettings(width=1.2)
    x, y, to_x, to_y = path
    pillar = torch.zeros(1, 1, 3).double()
    start, end = (torch.tensor([[*p, 2.5]]).double() for p in ((x, y), (to_x, to_y)))
    found = bool(meets(settings.touch_distance, start, end, pillar))
    points = start[0, :2] + torch.linspace(0, 1, 2001)[:, None].double() * (end - start)[0, :2]
    reach = points.abs().amax(-1)
    if found != bool((reach <= 1).any()):  # up to the resolution of 2,001 points
        assert (reach - 1).abs().min() < 8 / 2000


def test_side_boundary_and_step_limit_end_the_episode(settings, field):
    state, _ = fly(settings, field(FAR, FAR, y=8.0), (0.0, 8.0))
    assert state.end_reason == EndReason.RUNNING
    state, _ = fly(settings, state, (0.0, 8.5))
    assert state.end_reason == EndReason.SIDE_BOUNDARY
    short = settings.replace(step_limit=20)
    state = field(FAR, FAR)
    state, _ = fly(short, state, *[(0.0, 0.0)] * 19)
    assert state.end_reason == EndReason.RUNNING
    assert fly(short, state, (0.0, 0.0))[0].end_reason == EndReason.STEP_LIMIT


def test_contact_precedes_finish_line_precedes_step_limit(settings, field):
    state, _ = fly(settings, field(FAR, (0.0, 6.0), x=14.0), (21.0, 0.0))
    assert state.end_reason == EndReason.PILLAR_TOUCHED
    short = settings.replace(step_limit=20)
    state, _ = fly(short, field(FAR, FAR), *[(0.0, 0.0)] * 19, (20.0, 0.0))
    assert state.end_reason == EndReason.FINISH_LINE


def test_lost_control_precedes_contact(settings, field):
    state = field((0.0, -6.0), FAR, x=7.0)
    lost = Floating(FLIGHT, None).start(torch.tensor([[8.5, 0.0, 2.5]]).double())
    state, _ = Pillars(settings).step(state, lost)
    assert state.end_reason == EndReason.PILLAR_TOUCHED
    lost.lost[:] = True
    state, _ = Pillars(settings).step(field((0.0, -6.0), FAR, x=7.0), lost)
    assert state.end_reason == EndReason.LOST_CONTROL and state.touched.any()


def test_rows_are_passed_in_order(settings, field):
    state = field(FAR, FAR)
    assert state.next_row == 0 and state.side[0].tolist() == [A, -1]
    state, _ = fly(settings, state, (10.0, 0.0))
    assert state.next_row == 0  # still next to the row
    state, _ = fly(settings, state, (10.1, 0.0))
    assert state.next_row == 1 and state.side[0].tolist() == [A, A]
    state, _ = fly(settings, state, (19.9, 0.0))
    assert state.passed[0].tolist() == [True, False]  # the last one is passed at the finish line
    state, _ = fly(settings, state, (20.0, 0.0))
    assert state.passed.all() and state.next_row == 2


def test_nearest_lane_has_a_side_and_a_gap(field):
    # the pillar at 0.9 blocks lanes 0 and 1; -1 is nearer than 2, between pillars at 0.9 and -6.0
    state = field((0.9, -6.0), FAR)
    assert state.side[0, 0] == R
    assert abs(float(state.gap[0, 0]) - (6.9 - 1.2)) < 1e-9
    # the pillar at 0.0 blocks lanes -1, 0, 1; 2 and -2 are tied, and the narrower gap's center wins
    state = field((0.0, 5.0), FAR)
    assert state.side[0, 0] == L and abs(float(state.gap[0, 0]) - 3.8) < 1e-9
    state = field((0.0, -5.0), FAR)
    assert state.side[0, 0] == R
    assert field((3.0, -3.0), FAR).side[0, 0] == A
    # the field ends at 8, so a pillar at 7.5 leaves no lane on its left
    assert field((7.5, 5.4), FAR, y=7.0).side[0, 0] == R


def test_lanes_are_relative_to_the_drone(settings):
    turns, is_open = Lanes(settings).lanes_from(
        torch.tensor([[[0.0, 20.0]]]).double(), torch.tensor([0.5]).double()
    )
    lanes = (turns + 0.5)[0][is_open[0, 0]]
    assert lanes.min() == -7.5 and lanes.max() == 7.5
    assert not ((lanes.abs() <= 1).any())


def test_environments_are_independent(settings, field):
    one, two = field((0.0, 5.0), FAR, x=7.0), field(FAR, FAR, x=7.0)
    both = Pillars(settings).start(
        torch.tensor([[(0.0, 5.0), FAR], [FAR, FAR]]).double(), _pair(7.0)
    )
    new, reward = Pillars(settings).step(both, _pair(8.0))
    for i, alone in enumerate((one, two)):
        expected, earned = Pillars(settings).step(alone, body(8.0, 0.0))
        assert new.end_reason[i] == expected.end_reason[0] and reward[i] == earned[0]
        assert torch.equal(new.side[i], expected.side[0])


def _pair(x):
    at = body(x, 0.0)
    return type(at)(*(torch.cat([v, v]) for v in vars(at).values()))


def test_lane_within_half_a_step_is_ahead(settings):
    for step in (1.0, 0.5):
        turns = step * torch.tensor([0.75, 0.51, 0.5, 0.0, -0.5, -0.51, -0.75])
        assert side_of(turns, 0.5 * step).tolist() == [L, L, A, A, A, R, R]


TASK = Pillars()


def test_next_target_is_the_nearest_pillar_of_the_next_row(field):
    assert TASK.next_target(field((5.0, -2.0), FAR)) == 1
    assert TASK.next_target(field((5.0, -2.0), FAR, y=4.0)) == 0
    state = field((5.0, -2.0), (7.0, 1.0))
    state.passed[:, 0] = True
    assert TASK.next_target(state) == 3
    assert TASK.next_offset(state)[0].tolist() == [16.0, 1.0, 0.0]
    state.passed[:] = True
    assert TASK.next_target(state) == 4 and TASK.next_offset(state).isnan().all()


def test_absent_pillars_are_ignored(field):
    state = TASK.without_next(field((5.0, -2.0), FAR))
    assert state.present[0].tolist() == [True, False, True, True]
    assert TASK.next_target(state) == 0
    assert TASK.next_target(TASK.without_next(state)) == 4


def test_one_target_places_a_single_pillar(settings):
    state = Pillars(settings).one_target(body(3.0, 1.0), torch.tensor([[5.0, -2.0, 0.0]]))
    assert state.pillars[0, 0].tolist() == [8.0, -1.0, 3.0] and state.present.sum() == 1


def test_elsewhere_moves_all_pillars_away_from_the_drone(field, settings):
    state = field((5.0, -2.0), FAR)
    generator = torch.Generator().manual_seed(0)
    other = Pillars(settings).elsewhere(state, CameraSettings(), generator)
    away = other.pillars[..., :2] - state.drone[:, None, :2]
    assert (away[..., 0] >= settings.touch_distance + settings.width).all()
    assert (other.pillars[..., 2] == 3.0).all() and other.present.all()
    assert not torch.isclose(other.pillars, state.pillars)[..., :2].all(-1).any()


def test_grid_covers_the_field(settings):
    grid = Pillars(settings).grid(3, 5)
    assert grid.forward.tolist() == [1.5, 5.25, 9.0]
    assert grid.lateral.tolist() == [8.0, 4.0, 0.0, -4.0, -8.0]


def test_elsewhere_covers_the_field_of_view(field, settings):
    """Positions reach from 2.2 m ahead to the second row at 16 m, and 16 m to each side."""
    state = field((5.0, -2.0), FAR)[torch.zeros(800, dtype=torch.int64)]
    camera = CameraSettings()
    found = Pillars(settings).elsewhere(state, camera, torch.Generator().manual_seed(0))
    away = (found.pillars[..., :2] - state.drone[:, None, :2]).flatten(0, 1)
    ahead, aside = away.unbind(-1)
    edge = math.tan(math.radians(camera.horizontal_fov / 2))
    assert 2.2 <= ahead.min() < 2.3 and 15.9 < ahead.max() <= 16.0
    slope = aside / ahead
    assert -edge <= slope.min() < -0.98 * edge and 0.98 * edge < slope.max() <= edge
    assert 15.5 < aside.abs().max() <= 16.0 + 1e-9 and abs(slope.mean()) < 0.1 * edge
    near = slope.abs() < 0.4 * edge  # all up to 16 m
    assert torch.corrcoef(torch.stack([ahead, slope])[:, near])[0, 1].abs() < 0.1
    assert abs(ahead[near].mean() - (2.2 + 16.0) / 2) < 0.4


def test_grid_starts_half_a_step_before_contact(settings):
    short = settings.replace(step_length=0.5)
    assert Pillars(short).grid(2, 2).forward.tolist() == [1.25, 9.0]


def test_needed_action_turns_away_from_a_pillar_ahead(settings):
    lateral = torch.tensor([3.0, 1.1, 1.0, 0.5, -0.5, -1.0, -1.1])
    offset = torch.stack([torch.full_like(lateral, 5.0), lateral, torch.zeros(7)], -1)
    task = Pillars(settings)
    f, left, right = Move.FORWARD, Move.LEFT, Move.RIGHT
    assert task.needed(offset).tolist() == [f, f, right, right, left, left, f]
    a, le, r = Side.AHEAD, Side.LEFT, Side.RIGHT
    assert task.stratum_at(offset).tolist() == [a, a, r, r, le, le, a]


def test_pillar_is_reached_when_passed_untouched(settings, field):
    task, target = Pillars(settings), torch.tensor([0])
    state = field((5.0, -5.0), (5.0, -5.0), x=9.0)
    assert not task.is_behind(state, target) and not task.is_reached(state, target)
    state.body = body(9.5, 0.0)
    assert task.is_behind(state, target) and task.is_reached(state, target)
    state.touched[:, 1] = True
    assert task.is_behind(state, target) and not task.is_reached(state, target)


def test_tally_counts_rows(settings):
    passed = torch.tensor([[True, False], [True, True]])
    reached, missed = Pillars(settings).tally({"passed": passed})
    assert reached.tolist() == [1, 2] and missed.tolist() == [0, 0]


def test_next_target_without_present_pillars_is_their_number(settings, field):
    task = Pillars(settings)
    state = task.without_targets(field((5.0, -5.0), (5.0, -5.0)))
    info = {**task.info(state), "drone": state.drone.float()}
    assert task.remember(info)["next_target"] == 4


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


def test_baselines_and_scored_entries_exist():
    task = Pillars()
    assert (task.name, task.vocabulary.goal, task.vocabulary.target) == ("pillars", "row", "pillar")
    assert task.success_end == EndReason.FINISH_LINE
    assert task.expected_end == EndReason.PILLAR_TOUCHED
    assert task.strata == ("left", "ahead", "right")
    assert task.oracle.reads == ("drone", "rows", "next_row")
    assert set(task.blind_baselines) - {"random"} == set(task.make_dynamics().actions.names)
    assert set(task.scored) <= set(task.entries)


def test_there_is_a_prop_for_each_pillar(settings):
    task = Pillars(settings)
    props = task.make_props()
    assert len(props) == 4 and {prop.semantic_class for prop in props} == {SemanticClass.OBSTACLE}
    assert len({prop.mjcf_model.model for prop in props}) == 4


def test_absent_pillars_are_below_the_floor(settings, field):
    state = field((5.0, -5.0), (5.0, -5.0))
    state.present[0, 2] = False
    z = Pillars(settings).places(state)[0, :, 2]
    assert z.tolist() == [3.0, 3.0, -97.0, 3.0]


def test_info_matches_the_entries(settings, field):
    task = Pillars(settings)
    info = task.info(field((5.0, -5.0), (1.5, -5.0)))
    assert set(info) == set(task.entries)
    for name, entry in task.entries.items():
        assert (info[name].shape[1:], info[name].dtype) == (entry.shape, entry.dtype), name
    assert info["rows"].tolist() == [[[5.0, -5.0], [1.5, -5.0]]]


def test_fields_are_sampled_from_the_given_stream(settings):
    task = Pillars(settings)
    one, two = (task.sample(np.random.RandomState(3)) for _ in range(2))
    assert one.shape == (2, 2) and torch.equal(one, two) and one.dtype == torch.float64


def test_entries_have_bounds(settings):
    entries = Pillars(settings).entries
    bounds = {name: (entry.low, entry.high) for name, entry in entries.items()}
    assert bounds["side"] == (-1, 2)  # unknown, or one of three
    assert bounds["next_row"] == (0, 2)
    assert bounds["end_reason"] == (0, 5)


def test_vocabulary_covers_sides_and_ends():
    said = Pillars().vocabulary
    assert set(said.sides) == set(said.places) == {side.name.lower() for side in Side}
    assert set(said.ends) == {end.name.lower() for end in EndReason if end}
    assert not said.follows and said.tested.startswith("4 rows of pillars 1 m wide, 0.25 per")
    assert said.reaches == "passes" and said.handles == "gets past the pillar"
    assert said.failing("row", "third") == "at the third row"
    assert said.failing("gap", "0.8 to 1.8 m") == "at gaps of 0.8 to 1.8 m"


def test_settings_create_the_task():
    task = as_task(PillarsSettings(num_rows=2))
    assert isinstance(task, Pillars) and task.settings.num_rows == 2
    assert Pillars().settings == PillarsSettings()


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
    assert state.end_reason == EndReason.PILLAR_TOUCHED
    assert state.touched[0].nonzero().tolist() == [[0]] and float(reward) < -0.49
