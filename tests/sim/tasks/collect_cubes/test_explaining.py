"""What is remembered of cubes, with numbers by hand; what is changed has tests of its own."""

import torch

from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes.rules import Side

TASK = CollectCubes()


def test_of_passed_and_collected_cubes_none_is_present():
    """The first is collected, the second passed: the third is the next one."""
    info = {
        "next_cube": torch.tensor([[2], [0]]),
        "collected": torch.tensor([[True, False, False], [False] * 3]),
        "cube_positions": torch.arange(18.0).view(2, 3, 3),
    }
    kept = TASK.remember(info)
    assert kept["present"].tolist() == [[False, False, True], [True] * 3]
    assert kept["next_target"].tolist() == [2, 0]
    body = BodyState.at_rest(torch.zeros(2, 3, dtype=torch.float64))
    state = TASK.recall({**kept, "step": torch.tensor([7, 0])}, body)
    assert state.passed.tolist() == [[False, True, False], [False] * 3]
    assert state.next_cube.tolist() == [2, 0] and state.steps.tolist() == [7, 0]
    assert state.cubes.dtype == torch.float64 and not state.end_reason.any()


def test_what_a_cube_calls_for_and_on_which_side_it_stands():
    """Up to 1.65 m aside flying straight on touches it."""
    aside = torch.tensor([3.0, 1.6, -1.6, -3.0])
    offset = torch.stack([torch.full((4,), 9.0), aside, torch.zeros(4)], -1)
    assert TASK.needed(offset).tolist() == [Move.LEFT, Move.FORWARD, Move.FORWARD, Move.RIGHT]
    assert TASK.stratum_at(offset).tolist() == [Side.LEFT, Side.AHEAD, Side.AHEAD, Side.RIGHT]


def test_each_world_is_asked_about_a_cube_of_its_own():
    body = BodyState.at_rest(torch.tensor([[20.0, 0.0, 2.5]] * 2, dtype=torch.float64))
    state = TASK.start(torch.tensor([[[15.0, 0, 2.5], [24.0, 0, 2.5], [33.0, 0, 2.5]]] * 2), body)
    state.collected[1, 1] = True
    target = torch.tensor([0, 1])
    assert TASK.is_behind(state, target).tolist() == [True, False]
    assert TASK.is_reached(state, target).tolist() == [False, True]
