"""Comparison with learners of other libraries, by short trainings."""

import numpy as np
import pytest


def test_the_running_mean_counts_whole_episodes_in_the_order_of_their_ends():
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    from benchmarks.peers.sb3 import Solved

    solved = Solved(target=2.0, decay=0.5)
    solved.count(np.array([1.0, 0.0]), np.array([False, False]))
    solved.count(np.array([2.0, 1.0]), np.array([True, True]))  # episodes of 3 and of 1
    assert (solved.running_reward, solved.episodes) == ((0.5 * 3) * 0.5 + 0.5 * 1, 2)
    solved.count(np.array([1.0, 2.0]), np.array([False, True]))  # one of 2
    assert (solved.running_reward, solved.is_reached) == (1.625, False)
    solved.count(np.array([2.0, 0.0]), np.array([True, False]))  # one of 3
    assert (solved.running_reward, solved.is_reached) == (2.3125, True)
