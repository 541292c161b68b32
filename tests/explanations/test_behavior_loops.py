import numpy as np
import pytest

from drone_rl.explanations.behavior import find_loops, summarise_loops
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.actions import MOVES
from tests.five_actions import FIVE

F, L, R = 0, 1, 2
UP, DOWN, LEFT, RIGHT, STAY = range(5)


def flights(actions, episode):
    return RolloutDataset({"actions": np.array(actions, int), "episode": np.array(episode)}, {}, {})


def test_loops_are_turns_without_progress():
    #         a loop of five    no loop     ends with the episode  two turns: a loop
    actions = [F, L, R, L, R, L, F, L, L, R, F, L, R, R, L, R, F]
    data = flights(actions, [0] * 12 + [1] * 5)
    loops = find_loops(data, MOVES)
    assert [tuple(loop.values()) for loop in loops] == [(1, 5, 4), (12, 4, 2)]
    summary = summarise_loops(data, loops)
    assert (summary["episodes"]["successes"], summary["episodes"]["trials"]) == (2, 2)
    assert summary["longest"] == 5 and summary["frames_share"] == pytest.approx(9 / 17)


def test_loops_at_the_first_and_at_the_last_frame():
    loops = find_loops(flights([L, R, L, F, R, L, R], [0] * 7), MOVES)
    assert [tuple(loop.values()) for loop in loops] == [(0, 3, 2), (4, 3, 2)]
    assert find_loops(flights([L, R], [0, 0]), MOVES) == []  # one turn
    assert len(find_loops(flights([L, R], [0, 0]), MOVES, min_reversals=1)) == 1
    assert (
        find_loops(flights([L, R, L, R], [0, 0, 1, 1]), MOVES) == []
    )  # one in each of two episodes


def test_without_frames_there_are_no_loops():
    assert find_loops(flights([], []), MOVES) == []


def test_episodes_with_a_loop_are_counted_once():
    data = flights([L, R, L, F, L, R, L, F, F, F], [0] * 8 + [1] * 2)
    summary = summarise_loops(data, find_loops(data, MOVES))
    assert summary["loops"] == 2 and summary["frames_share"] == pytest.approx(0.6)
    assert (summary["episodes"]["successes"], summary["episodes"]["trials"]) == (1, 2)
    assert summary["list"][1] == {"first": 4, "length": 3, "reversals": 2}


def test_none_seen_is_not_never():
    summary = summarise_loops(flights([F] * 30, range(30)), [])
    assert summary["loops"] == summary["longest"] == 0
    # 1 - 0.025 ** (1 / 30)
    assert summary["episodes"]["upper95"] == pytest.approx(0.1157, abs=1e-4)


def test_in_another_set_of_actions_loops_are_made_of_whatever_undoes_what():
    """Up and down go nowhere; up and left is a way; staying is nothing that one can undo."""
    moves = [UP, DOWN, UP, STAY, UP, LEFT, UP, LEFT, STAY, LEFT, RIGHT, LEFT, RIGHT]
    loops = find_loops(flights(moves, [0] * len(moves)), FIVE)
    assert [tuple(loop.values()) for loop in loops] == [(0, 3, 2), (9, 4, 3)]
