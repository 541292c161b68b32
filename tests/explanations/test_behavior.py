import dataclasses

import numpy as np
import pytest

from drone_rl.explanations.behavior import Pair, find_pairs, median_frame_change, summarise_pairs
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.actions import MOVES

F, L, R = 0, 1, 2


def fake(observations, probabilities, offsets, actions=None, episode=None):
    count = len(probabilities)
    arrays = {
        "observations": np.asarray(observations, np.float32).reshape(count, 1, 1, -1),
        "probabilities": np.asarray(probabilities, np.float32),
        "actions": np.asarray(actions if actions is not None else [F] * count),
        "episode": np.asarray(episode if episode is not None else [0] * count),
    }
    return RolloutDataset(arrays, {}, {"offsets": np.array(offsets, np.float64)})


def pairs_of(data, alike):
    return find_pairs(data, alike, MOVES, data.meta["offsets"])


LEFT, RIGHT = [0.0, 0.9, 0.1], [0.0, 0.1, 0.9]


def test_pairs_are_split_by_where_the_cube_is():
    # frames 0 and 1 look alike, so do 2 and 3, 4 and 5; only in the first pair the cube stands
    # alike (1 m away), in the second it is 6 m off, in the third there is none
    data = fake(
        observations=[[0, 0], [0, 0.1], [5, 5], [5, 5.1], [9, 9], [9, 9.1]],
        probabilities=[LEFT, RIGHT, RIGHT, LEFT, LEFT, RIGHT],
        offsets=[[5, 1], [6, 2], [5, 3], [5, -3], [5, 1], [5, 1]],
    )
    data.meta["offsets"][4] = np.nan
    pairs = pairs_of(data, alike=0.1)
    assert {(p.left, p.right): p.kind for p in pairs} == {
        (0, 1): "contradiction", (3, 2): "justified", (4, 5): "unknown",
    }  # fmt: skip
    assert pairs[0].opposition == pytest.approx(0.8)
    assert pairs[0].distance == pytest.approx(0.1 / np.sqrt(2))
    summary = summarise_pairs(pairs, data, 0.1)
    assert (summary["contradictions"], summary["justified"], summary["unknown"]) == (1, 1, 1)
    assert summary["pairs"] == 3 and summary["worst_opposition"] == pytest.approx(0.8)


def test_the_worst_is_the_most_opposed():
    data = fake(
        observations=[[0, 0], [0, 0.1], [5, 5], [5, 5.1]],
        probabilities=[LEFT, RIGHT, [0.0, 0.7, 0.3], [0.0, 0.3, 0.7]],
        offsets=[[5, 1]] * 4,
    )
    summary = summarise_pairs(pairs_of(data, alike=0.1), data, 0.1)
    assert summary["contradictions"] == 2
    assert summary["worst_opposition"] == pytest.approx(0.8)


def test_pictures_farther_apart_are_not_alike():
    data = fake([[0, 0], [0, 0.1]], [LEFT, RIGHT], [[5, 1], [5, 1]])
    assert len(pairs_of(data, alike=0.0708)) == 1  # 0.1 / sqrt(2) = 0.07071
    assert pairs_of(data, alike=0.0707) == []


def test_wishes_less_opposed_are_no_pair():
    data = fake([[0, 0]] * 2, [[0.8, 0.2, 0.0], [0.8, 0.01, 0.19]], [[5, 1]] * 2)
    assert pairs_of(data, alike=1.0) == []  # opposed by 0.19
    data = fake([[0, 0]] * 2, [[0.8, 0.2, 0.0], [0.8, 0.0, 0.2]], [[5, 1]] * 2)
    assert len(pairs_of(data, alike=1.0)) == 1  # by just 0.2


def test_of_equally_opposed_pairs_the_more_alike_comes_first():
    data = fake([[0], [3], [2]], [LEFT, RIGHT, RIGHT], [[5, 1]] * 3)
    assert [(p.left, p.right) for p in pairs_of(data, alike=9.0)] == [(0, 2)]


def test_pairs_are_found_across_more_frames_than_are_compared_at_once():
    count = 1203
    probs = np.tile([1.0, 0.0, 0.0], (count, 1))
    probs[[2, 700, 1202]] = [RIGHT, LEFT, RIGHT]
    data = fake(np.zeros((count, 1)), probs, [[5, 1]] * count)
    data.arrays["observations"][2] = 1.0  # a little less alike
    pairs = pairs_of(data, alike=1.0)
    assert [(p.left, p.right, p.distance) for p in pairs] == [(700, 1202, 0.0)]


def test_a_cube_stands_alike_up_to_one_metre():
    data = fake([[0]] * 2, [LEFT, RIGHT], [[5, 1], [5, 2]])
    assert pairs_of(data, alike=1.0)[0].kind == "contradiction"
    data = fake([[0]] * 2, [LEFT, RIGHT], [[5, 1], [6.01, 1]])
    assert pairs_of(data, alike=1.0)[0].kind == "justified"


def test_each_frame_is_in_one_pair_and_the_most_opposed_comes_first():
    probs = [[0, 0.7, 0.3], [0, 0.9, 0.1], RIGHT]
    pairs = pairs_of(fake(np.zeros((3, 2)), probs, [[5, 1]] * 3), alike=1.0)
    assert [(p.left, p.right) for p in pairs] == [(1, 2)]


def test_all_pairs_are_counted_and_fifty_are_listed():
    data = fake(np.zeros((110, 2)), [LEFT, RIGHT] * 55, [[5, 1]] * 110)
    summary = summarise_pairs(pairs_of(data, alike=1.0), data, 1.0)
    assert summary["pairs"] == summary["contradictions"] == 55
    assert len(summary["list"]) == 50


def test_a_pair_is_a_fact():
    pair = Pair(0, 1, 0.5, 0.5, "unknown")
    with pytest.raises(dataclasses.FrozenInstanceError):
        pair.kind = "contradiction"


def test_one_action_makes_no_pairs():
    data = fake(np.zeros((5, 2)), [[0, 1, 0]] * 5, [[5, 1]] * 5)
    assert pairs_of(data, alike=1.0) == []
    assert summarise_pairs([], data, 1.0)["worst_opposition"] is None


def test_one_move_is_the_median_change_within_episodes():
    # root mean squares of 6, 1, 3 and, in the second episode, 4 and 5; what lies between the two
    # episodes, 90, does not count
    pictures = [[0, 0], [6, 6], [7, 7], [10, 4], [100, 100], [104, 104], [99, 99]]
    data = fake(pictures, np.zeros((7, 3)), np.zeros((7, 2)), episode=[0, 0, 0, 0, 1, 1, 1])
    assert median_frame_change(data) == pytest.approx(4.0)
    data.arrays["episode"][4:] = [1, 2, 3]
    assert median_frame_change(data) == pytest.approx(3.0)
    assert median_frame_change(fake([[0]], np.zeros((1, 3)), np.zeros((1, 2)))) == 0.0
