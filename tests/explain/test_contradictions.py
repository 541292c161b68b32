import numpy as np
import pytest

from drone_rl.explain.contradictions import (
    find_loops,
    find_pairs,
    opposition,
    summarise_loops,
    summarise_pairs,
)
from drone_rl.explain.dataset import RolloutDataset

F, L, R = 0, 1, 2


def fake(observations, probabilities, offsets, actions=None, episode=None):
    count = len(probabilities)
    cubes = np.zeros((count, 1, 3))
    cubes[:, 0, :2] = offsets
    arrays = {
        "observations": np.asarray(observations, np.float32).reshape(count, 1, 1, -1),
        "probabilities": np.asarray(probabilities, np.float32),
        "drone": np.zeros((count, 3)),
        "cubes": cubes,
        "next_cube": np.zeros(count, int),
        "actions": np.asarray(actions if actions is not None else [F] * count),
        "episode": np.asarray(episode if episode is not None else [0] * count),
    }
    return RolloutDataset(arrays, {}, {})


def test_opposition_by_hand():
    sure_left, sure_right, forward = np.eye(3)[[L, R, F]]
    assert opposition(sure_left, sure_right) == 1.0
    assert opposition(sure_right, sure_left) == -1.0
    assert opposition(sure_left, forward) == 0.0
    assert opposition(np.array([0, 0.7, 0.3]), np.array([0, 0.4, 0.6])) == pytest.approx(0.3)


def test_pairs_are_split_by_where_the_cube_is():
    left, right = [0.0, 0.9, 0.1], [0.0, 0.1, 0.9]
    # frames 0 and 1 look alike, so do 2 and 3; only in the first pair the cube stands alike
    data = fake(
        observations=[[0, 0], [0, 0.1], [5, 5], [5, 5.1]],
        probabilities=[left, right, right, left],
        offsets=[[5, 1], [5, 1.5], [5, 3], [5, -3]],
    )
    pairs = find_pairs(data)
    assert {(p.left, p.right): p.contradiction for p in pairs} == {(0, 1): True, (3, 2): False}
    assert pairs[0].opposition == pytest.approx(0.8)
    summary = summarise_pairs(pairs)
    assert (summary["contradictions"], summary["justified"]) == (1, 1)


def test_one_action_makes_no_pairs():
    data = fake(np.zeros((5, 2)), [[0, 1, 0]] * 5, [[5, 1]] * 5)
    assert find_pairs(data) == []
    assert summarise_pairs([])["worst_opposition"] == 0.0


def test_loops_are_turns_without_progress():
    #         a loop of five    no loop     ends with the episode  two turns: a loop
    actions = [F, L, R, L, R, L, F, L, L, R, F, L, R, R, L, R, F]
    episode = [0] * 12 + [1] * 5
    data = fake(np.zeros((17, 1)), np.zeros((17, 3)), np.zeros((17, 2)), actions, episode)
    loops = find_loops(data)
    assert [(loop.first, loop.length, loop.reversals) for loop in loops] == [(1, 5, 4), (12, 4, 2)]
    assert summarise_loops(data, loops)["episodes_with_loops"] == 2
