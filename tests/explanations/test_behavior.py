"""Verdict, robustness, statistics of the data set, contradictions and loops."""

from types import SimpleNamespace

import numpy as np
import pytest

from drone_rl.explanations.behavior import (
    dataset_section,
    find_loops,
    find_pairs,
    flaws_section,
    median_change,
    verdict_section,
)
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.actions import MOVES
from tests.five_actions import FIVE

F, L, R = 0, 1, 2


def fake(observations, probabilities, offsets, actions=None, episode=None):
    count = len(probabilities)
    arrays = {
        "observations": np.asarray(observations, np.float32).reshape(count, 1, 1, -1),
        "probabilities": np.asarray(probabilities, np.float32),
        "actions": np.asarray(actions if actions is not None else [F] * count),
        "episode": np.asarray(episode if episode is not None else [0] * count),
        "offsets": np.array(offsets, np.float64),
    }
    return RolloutDataset(arrays)


def pairs_of(data, alike):
    return find_pairs(data, alike, MOVES, data.offsets)


LEFT, RIGHT = [0.0, 0.9, 0.1], [0.0, 0.1, 0.9]


def test_pairs_are_classified_by_the_place_of_the_target():
    # frames 0 and 1 look alike, so do 2 and 3, 4 and 5; only in the first pair the cube stands
    # alike (1 m away), in the second it is 6 m off, in the third there is none
    data = fake(
        observations=[[0, 0], [0, 0.1], [5, 5], [5, 5.1], [9, 9], [9, 9.1]],
        probabilities=[LEFT, RIGHT, RIGHT, LEFT, LEFT, RIGHT],
        offsets=[[5, 1], [6, 2], [5, 3], [5, -3], [5, 1], [5, 1]],
    )
    data.offsets[4] = np.nan
    pairs = pairs_of(data, alike=0.1)
    assert {(p.left, p.right): p.kind for p in pairs} == {
        (0, 1): "contradiction", (3, 2): "justified", (4, 5): "unknown",
    }  # fmt: skip
    assert pairs[0].opposition == pytest.approx(0.8)
    assert pairs[0].distance == pytest.approx(0.1 / np.sqrt(2))


def test_the_least_opposition_of_a_pair():
    data = fake([[0, 0]] * 2, [[0.8, 0.2, 0.0], [0.8, 0.01, 0.19]], [[5, 1]] * 2)
    assert pairs_of(data, alike=1.0) == []  # opposed by 0.19
    data = fake([[0, 0]] * 2, [[0.8, 0.2, 0.0], [0.8, 0.0, 0.2]], [[5, 1]] * 2)
    assert len(pairs_of(data, alike=1.0)) == 1  # by just 0.2


def test_pairs_are_found_across_more_frames_than_are_compared_at_once():
    count = 1203
    probs = np.tile([1.0, 0.0, 0.0], (count, 1))
    probs[[2, 700, 1202]] = [RIGHT, LEFT, RIGHT]
    data = fake(np.zeros((count, 1)), probs, [[5, 1]] * count)
    data.arrays["observations"][2] = 1.0  # a little less alike
    pairs = pairs_of(data, alike=1.0)
    assert [(p.left, p.right, p.distance) for p in pairs] == [(700, 1202, 0.0)]


def test_targets_within_a_metre_are_at_the_same_place():
    data = fake([[0]] * 2, [LEFT, RIGHT], [[5, 1], [5, 2]])
    assert pairs_of(data, alike=1.0)[0].kind == "contradiction"
    data = fake([[0]] * 2, [LEFT, RIGHT], [[5, 1], [6.01, 1]])
    assert pairs_of(data, alike=1.0)[0].kind == "justified"


def test_each_frame_is_in_one_pair():
    probs = [[0, 0.7, 0.3], [0, 0.9, 0.1], RIGHT]
    pairs = pairs_of(fake(np.zeros((3, 2)), probs, [[5, 1]] * 3), alike=1.0)
    assert [(p.left, p.right) for p in pairs] == [(1, 2)]


def test_the_median_change_is_within_episodes():
    # root mean squares of 6, 1, 3 and, in the second episode, 4 and 5; what lies between the two
    # episodes, 90, does not count
    pictures = [[0, 0], [6, 6], [7, 7], [10, 4], [100, 100], [104, 104], [99, 99]]
    data = fake(pictures, np.zeros((7, 3)), np.zeros((7, 2)), episode=[0, 0, 0, 0, 1, 1, 1])
    assert median_change(data.observations, data.episode) == pytest.approx(4.0)
    data.arrays["episode"][4:] = [1, 2, 3]
    assert median_change(data.observations, data.episode) == pytest.approx(3.0)
    assert median_change(np.zeros((1, 3)), np.zeros(1)) == 0.0


class Frames(SimpleNamespace):
    def __len__(self):
        return len(self.episode)


def test_statistics_of_the_data_set_by_hand():
    certain, torn, toss = [1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [1 / 3] * 3
    data = Frames(probabilities=np.array([certain, torn, toss], np.float32), episode=[0, 1, 1])
    data.episode = np.array(data.episode)
    flights = Frames(
        episode=np.array([0, 0, 0, 1, 2]),
        actions=np.array([0, 0, 0, 2, 0]),
        event=np.array([0, 1, 1, 0, -1], np.int8),
    )
    context = SimpleNamespace(dataset=data, flights=flights, remembers=False)
    found = dataset_section(context)
    assert (found.frames, found.episodes, found.steps, found.goals_reached) == (3, 3, 5, 2)
    assert found.action_shares == (0.8, 0.0, 0.2)
    # an episode counts once: 0, and the mean of log 2 / log 3 and 1
    assert found.entropy.mean == pytest.approx((0 + (np.log(2) / np.log(3) + 1) / 2) / 2)


UP, DOWN, TO_LEFT, TO_RIGHT, STAY = range(5)


def flights(actions, episode):
    return RolloutDataset({"actions": np.array(actions, int), "episode": np.array(episode)})


def loops_of(moves, episode, actions=MOVES):
    loops = find_loops(flights(moves, episode), actions)
    return [(loop.first, loop.length, loop.reversals) for loop in loops]


def test_loops_by_hand():
    #         a loop of five    no loop     ends with the episode  two turns: a loop
    actions = [F, L, R, L, R, L, F, L, L, R, F, L, R, R, L, R, F]
    assert loops_of(actions, [0] * 12 + [1] * 5) == [(1, 5, 4), (12, 4, 2)]


def test_loops_with_other_actions():
    """Up and down are opposites, up and left are not; a stay can't be undone."""
    moves = [UP, DOWN, UP, STAY, UP, TO_LEFT, UP, TO_LEFT, STAY]
    moves += [TO_LEFT, TO_RIGHT, TO_LEFT, TO_RIGHT]
    assert loops_of(moves, [0] * len(moves), FIVE) == [(0, 3, 2), (9, 4, 3)]


def test_episodes_with_a_loop_are_counted_once():
    data = fake(np.zeros((10, 1)), [LEFT] * 10, [[5, 1]] * 10)
    data.arrays["actions"][:] = [L, R, L, F, L, R, L, F, F, F]
    data.arrays["episode"][8:] = 1
    data.offset = lambda worlds: data.offsets
    scenes = SimpleNamespace(actions=MOVES, worlds=None)
    parts = {"dataset": data, "flights": data, "scenes": scenes, "remembers": False}
    found = flaws_section(SimpleNamespace(**parts))
    assert len(found.loops) == 2 and found.looping_steps == pytest.approx(0.6)
    assert (found.looping_episodes.successes, found.looping_episodes.trials) == (1, 2)


def test_the_verdict_does_not_depend_on_earlier_episodes(context):
    verdict = verdict_section(context)
    assert (verdict.greedy.episodes, verdict.good_share) == (6, 0.7)
    assert verdict_section(context) == verdict
