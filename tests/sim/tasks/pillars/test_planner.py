import itertools

import numpy as np
import torch

from drone_rl.config import PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.tasks.pillars import field, rules
from drone_rl.sim.tasks.pillars.planner import first_turn, fly_through
from drone_rl.sim.tasks.pillars.rules import EndReason

SETTINGS = PillarsSettings(num_rows=3, spread=4.0, density=0.4, width=1.2)
"""Three pillars a row, nine lanes; drone and pillars touch up to 1 m."""


def fewest_turns(rows, y, next_row):
    """By trying every choice of lanes: metres of turns in all, and to the first row's lane."""
    lanes = field.lanes(SETTINGS)
    opened = [lanes[o] for o in field.is_open(SETTINGS, rows[next_row:])]
    ways = [np.diff([y, *way]) for way in itertools.product(*opened)]
    total = [np.abs(way).sum() for way in ways]
    return min(total), {way[0] for way, t in zip(ways, total, strict=True) if t == min(total)}


def test_the_plan_has_the_fewest_turns_there_are():
    random_state = np.random.RandomState(0)
    for _ in range(60):
        rows = field.draw_field(SETTINGS, random_state)
        y, row = float(random_state.randint(-4, 5)), random_state.randint(3)
        turn = first_turn(
            SETTINGS, torch.from_numpy(rows)[None], torch.tensor([y]).double(), torch.tensor([row])
        )
        assert float(turn) in fewest_turns(rows, y, row)[1]


def test_looking_ahead_beats_the_nearest_lane():
    # the nearest ways lead right, then far back to the left
    rows = np.array([[0.2, 0.2, 0.2], [-2.0, -1.0, 1.2], [-2.0, -1.0, 1.2]])
    turn = first_turn(
        SETTINGS, torch.from_numpy(rows)[None], torch.zeros(1).double(), torch.tensor([0])
    )
    total, best = fewest_turns(rows, 0.0, 0)
    assert (total, best) == (3.0, {2.0, 3.0}) and float(turn) in best


def test_nothing_is_turned_for_behind_the_last_row():
    rows = torch.zeros(1, 3, 3).double()
    assert first_turn(SETTINGS, rows, torch.zeros(1).double(), torch.tensor([3])) == 0
    drone = torch.tensor([[SETTINGS.last_distance + 1.5, 0.0, 2.5]])
    assert fly_through(SETTINGS, drone, rows, torch.tensor([[2]])) == Move.FORWARD


def test_beside_a_row_one_flies_on():
    rows = torch.tensor([[[3.0, 3.0, 3.0], [0.0, 0.0, 0.0], [3.0, 3.0, 3.0]]]).double()
    drone = torch.tensor([[9.0, 0.0, 2.5], [11.0, 0.0, 2.5]])
    moves = fly_through(SETTINGS, drone, rows.repeat(2, 1, 1), torch.tensor([[0], [1]]))
    assert moves[0] == Move.FORWARD and moves[1] in (Move.LEFT, Move.RIGHT)


def test_every_field_is_crossed():
    random_state = np.random.RandomState(7)
    drawn = np.stack([field.draw_field(SETTINGS, random_state) for _ in range(300)])
    dynamics = ComputerVision(SETTINGS.step_length)
    body = dynamics.start(torch.tensor([[0.0, 0.0, 2.5]]).double().repeat(300, 1))
    state = rules.start(SETTINGS, torch.from_numpy(drawn), body)
    for _ in range(SETTINGS.step_limit):
        on = (state.end_reason == 0).nonzero()[:, 0]
        if not len(on):
            break
        now = state[on]
        move = fly_through(SETTINGS, now.drone, now.rows, now.next_row[:, None])
        state[on] = rules.judge(SETTINGS, now, dynamics.step(now.body, move))[0]
    assert (state.end_reason == EndReason.FINISH_LINE).all()
