import torch

from drone_rl.sim.actions import Move
from drone_rl.sim.tasks import Pillars
from drone_rl.sim.tasks.pillars.rules import Side
from tests.sim.tasks.pillars.conftest import body


def test_a_pillar_in_the_way_calls_for_a_turn_away_from_it(settings):
    lateral = torch.tensor([3.0, 1.1, 1.0, 0.5, -0.5, -1.0, -1.1])
    offset = torch.stack([torch.full_like(lateral, 5.0), lateral, torch.zeros(7)], -1)
    task = Pillars(settings)
    f, left, right = Move.FORWARD, Move.LEFT, Move.RIGHT
    assert task.needed(offset).tolist() == [f, f, right, right, left, left, f]
    a, le, r = Side.AHEAD, Side.LEFT, Side.RIGHT
    assert task.stratum_at(offset).tolist() == [a, a, r, r, le, le, a]


def test_a_pillar_is_done_once_the_drone_is_beyond_it_untouched(settings, field):
    task, target = Pillars(settings), torch.tensor([0])
    state = field((5.0, -5.0), (5.0, -5.0), x=9.0)
    assert not task.is_behind(state, target) and not task.is_reached(state, target)
    state.body = body(9.5, 0.0)
    assert task.is_behind(state, target) and task.is_reached(state, target)
    state.touched[:, 1] = True
    assert task.is_behind(state, target) and not task.is_reached(state, target)


def test_rows_are_counted(settings):
    passed = torch.tensor([[True, False], [True, True]])
    reached, missed = Pillars(settings).tally({"passed": passed})
    assert reached.tolist() == [1, 2] and missed.tolist() == [0, 0]


def test_of_what_does_not_stand_none_is_next(settings, field):
    task = Pillars(settings)
    state = task.without_targets(field((5.0, -5.0), (5.0, -5.0)))
    told = {**task.info(state), "drone": state.drone.float()}
    assert task.remember(told)["next_target"] == 4
