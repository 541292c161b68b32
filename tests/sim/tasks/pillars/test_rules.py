import torch
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks.pillars import rules
from drone_rl.sim.tasks.pillars.rules import EndReason, Side
from tests.fake_flight import FLIGHT, Floating
from tests.sim.tasks.pillars.conftest import body

L, A, R = Side.LEFT, Side.AHEAD, Side.RIGHT
FAR = (6.0, -6.0)
"""Pillars that leave the middle free."""


def fly(settings, state, *places):
    """From place to place; the last state and the sum of the rewards."""
    total = 0.0
    for x, y in places:
        state, reward = rules.judge(settings, state, body(x, y))
        total += float(reward)
    return state, total


def test_codes_are_those_of_recorded_files():
    ends = (
        *("RUNNING", "FINISH_LINE", "PILLAR_TOUCHED", "SIDE_BOUNDARY", "STEP_LIMIT"),
        "LOST_CONTROL",
    )
    assert [(e.name, e.value) for e in EndReason] == [(n, i) for i, n in enumerate(ends)]
    assert [(s.name, s.value) for s in Side] == [("LEFT", 0), ("AHEAD", 1), ("RIGHT", 2)]


def test_pillars_stand_in_rows(field):
    state = field((5.0, -5.0), (1.0, 2.0))
    assert state.pillars[0].tolist() == [[9, 5, 3], [9, -5, 3], [16, 1, 3], [16, 2, 3]]
    assert state.present.all() and not state.touched.any() and not state.passed.any()


def test_progress_is_the_reward_and_the_whole_way_is_worth_one(settings, field):
    state, reward = fly(settings, field(FAR, FAR), (1, 0))
    assert reward == 1 / 20 and state.end_reason == EndReason.RUNNING
    state, reward = fly(settings, field(FAR, FAR), (1, 0), (1, 1), (1, 0))
    assert reward == 1 / 20  # sideways is none
    way = [(x, 0) for x in range(1, 21)]
    state, reward = fly(settings, field(FAR, FAR), *way)
    assert abs(reward - 1) < 1e-12 and state.end_reason == EndReason.FINISH_LINE
    state, reward = fly(settings, field(FAR, FAR, x=19.5), (21.5, 0))
    assert abs(reward - 0.5 / 20) < 1e-12  # beyond the line there is nothing to gain


def test_a_touched_pillar_ends_the_flight_and_costs_the_penalty(settings, field):
    state, reward = fly(settings, field((0.9, -6.0), FAR, x=7.0), (8.0, 0.0))
    assert state.end_reason == EndReason.PILLAR_TOUCHED and reward == 1 / 20
    assert state.touched[0].tolist() == [True, False, False, False]
    dear = settings.replace(collision_penalty=3.0)
    assert fly(dear, field((0.9, -6.0), FAR, x=7.0), (8.0, 0.0))[1] == 1 / 20 - 3


def test_one_metre_is_a_touch_and_a_little_more_is_none(settings, field):
    for y, touches in ((1.0, True), (1.001, False), (-1.0, True), (-1.001, False)):
        state, _ = fly(settings, field((y, 6.0), FAR, x=8.5), (9.0, 0.0))
        assert bool(state.touched.any()) is touches


def test_what_is_flown_through_is_touched_however_long_the_move(settings):
    pillars = torch.tensor([[[9.0, 0.0, 3.0]]]).double()

    def meets(x, y, to_x, to_y):
        at = [torch.tensor([[a, b, 2.5]]).double() for a, b in ((x, y), (to_x, to_y))]
        return bool(rules.meets(settings, *at, pillars))

    assert meets(0, 0, 20, 0) and meets(20, 0, 0, 0)
    assert meets(9, -5, 9, 5) and not meets(7.9, -5, 7.9, 5)
    assert not meets(0, 0, 7.9, 0) and meets(0, 0, 8.0, 0)
    assert meets(9, 0, 9, 0) and not meets(7, 0, 7, 0)
    assert meets(7, -2, 9, 0) and not meets(6, -1, 8.5, 1.6)  # past the corner at (8, 1)
    assert not meets(6.5, 0, 8.9, 2.5)


@given(st.tuples(*[st.floats(-4, 4)] * 4))
@hypothesis_settings(max_examples=200, deadline=None)
def test_a_way_meets_a_pillar_where_any_of_its_points_does(way):
    settings = PillarsSettings(width=1.2)
    x, y, to_x, to_y = way
    pillar = torch.zeros(1, 1, 3).double()
    start, end = (torch.tensor([[*p, 2.5]]).double() for p in ((x, y), (to_x, to_y)))
    found = bool(rules.meets(settings, start, end, pillar))
    points = start[0, :2] + torch.linspace(0, 1, 2001)[:, None].double() * (end - start)[0, :2]
    reach = points.abs().amax(-1)
    if found != bool((reach <= 1).any()):  # only within what 2,001 points can tell
        assert (reach - 1).abs().min() < 8 / 2000


def test_who_leaves_the_field_is_out_and_who_takes_too_long_is_cut_off(settings, field):
    state, _ = fly(settings, field(FAR, FAR, y=8.0), (0.0, 8.0))
    assert state.end_reason == EndReason.RUNNING
    state, _ = fly(settings, state, (0.0, 8.5))
    assert state.end_reason == EndReason.SIDE_BOUNDARY
    short = settings.replace(step_limit=20)
    state = field(FAR, FAR)
    state, _ = fly(short, state, *[(0.0, 0.0)] * 19)
    assert state.end_reason == EndReason.RUNNING
    assert fly(short, state, (0.0, 0.0))[0].end_reason == EndReason.STEP_LIMIT


def test_a_pillar_counts_more_than_the_line_and_the_line_more_than_the_limit(settings, field):
    state, _ = fly(settings, field(FAR, (0.0, 6.0), x=14.0), (21.0, 0.0))
    assert state.end_reason == EndReason.PILLAR_TOUCHED
    short = settings.replace(step_limit=20)
    state, _ = fly(short, field(FAR, FAR), *[(0.0, 0.0)] * 19, (20.0, 0.0))
    assert state.end_reason == EndReason.FINISH_LINE


def test_a_lost_drone_counts_more_than_a_pillar(settings, field):
    state = field((0.0, -6.0), FAR, x=7.0)
    lost = Floating(FLIGHT, None).start(torch.tensor([[8.5, 0.0, 2.5]]).double())
    state, _ = rules.judge(settings, state, lost)
    assert state.end_reason == EndReason.PILLAR_TOUCHED
    lost.lost[:] = True
    state, _ = rules.judge(settings, field((0.0, -6.0), FAR, x=7.0), lost)
    assert state.end_reason == EndReason.LOST_CONTROL and state.touched.any()


def test_rows_come_up_one_after_the_other_and_are_passed_behind_them(settings, field):
    state = field(FAR, FAR)
    assert state.next_row == 0 and state.side[0].tolist() == [A, -1]
    state, _ = fly(settings, state, (10.0, 0.0))
    assert state.next_row == 0  # still beside it
    state, _ = fly(settings, state, (10.1, 0.0))
    assert state.next_row == 1 and state.side[0].tolist() == [A, A]
    state, _ = fly(settings, state, (19.9, 0.0))
    assert state.passed[0].tolist() == [True, False]  # the last one only at the line
    state, _ = fly(settings, state, (20.0, 0.0))
    assert state.passed.all() and state.next_row == 2


def test_the_nearest_way_through_has_a_side_and_a_gap(field):
    # of 0.9 the lanes 0 and 1 touch: -1 is nearer than 2; between pillars at 0.9 and -6.0
    state = field((0.9, -6.0), FAR)
    assert state.side[0, 0] == R
    assert abs(float(state.gap[0, 0]) - (6.9 - 1.2)) < 1e-9
    # of 0.0 the lanes -1, 0, 1 touch; 2 and -2 are as near, and the narrower gap's middle nearer
    state = field((0.0, 5.0), FAR)
    assert state.side[0, 0] == L and abs(float(state.gap[0, 0]) - 3.8) < 1e-9
    state = field((0.0, -5.0), FAR)
    assert state.side[0, 0] == R
    assert field((3.0, -3.0), FAR).side[0, 0] == A
    # the field ends at 8: a pillar at 7.5 leaves nothing on its left
    assert field((7.5, 5.4), FAR, y=7.0).side[0, 0] == R


def test_where_the_drone_is_off_its_lattice_lanes_are_seen_from_it(settings):
    turns, is_open = rules.ways(
        settings, torch.tensor([[[0.0, 20.0]]]).double(), torch.tensor([0.5]).double()
    )
    lanes = (turns + 0.5)[0][is_open[0, 0]]
    assert lanes.min() == -7.5 and lanes.max() == 7.5
    assert not ((lanes.abs() <= 1).any())


def test_worlds_are_judged_each_for_itself(settings, field):
    one, two = field((0.0, 5.0), FAR, x=7.0), field(FAR, FAR, x=7.0)
    both = rules.start(settings, torch.tensor([[(0.0, 5.0), FAR], [FAR, FAR]]).double(), _pair(7.0))
    new, reward = rules.judge(settings, both, _pair(8.0))
    for i, alone in enumerate((one, two)):
        expected, earned = rules.judge(settings, alone, body(8.0, 0.0))
        assert new.end_reason[i] == expected.end_reason[0] and reward[i] == earned[0]
        assert torch.equal(new.side[i], expected.side[0])


def _pair(x):
    at = body(x, 0.0)
    return type(at)(*(torch.cat([v, v]) for v in vars(at).values()))


def test_a_way_is_ahead_within_half_a_step(settings):
    for step in (1.0, 0.5):
        short = settings.replace(step_length=step)
        turns = step * torch.tensor([0.75, 0.51, 0.5, 0.0, -0.5, -0.51, -0.75])
        assert rules.side_of(short, turns).tolist() == [L, L, A, A, A, R, R]
