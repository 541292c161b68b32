import numpy as np
import pytest

from drone_rl.utils.intervals import episode_means, mean_bounds, mean_interval

NAN = np.nan


def test_each_episode_counts_once():
    # 0.5 of episode 0 and 1 of episode 1, however many frames each has; episode 2 says nothing
    values = np.array([0.0, 1.0, 1.0, NAN, 1.0, 1.0, NAN])
    episode = np.array([0, 0, 1, 1, 1, 1, 2])
    assert episode_means(values, episode).tolist() == [0.5, 1.0]
    found = mean_interval(values, episode)
    expected = mean_bounds([0.5, 1.0])
    assert found["mean"] == 0.75
    assert (found["lower95"], found["upper95"]) == (expected["lower95"], expected["upper95"])
    assert (found["frames"], found["episodes"]) == (5, 2)


def test_more_frames_of_an_episode_tell_no_more_of_others():
    few = mean_interval(np.ones(5), np.arange(5))
    many = mean_interval(np.ones(500), np.arange(500) // 100)
    assert few["lower95"] == many["lower95"] < 0.6


def test_the_range_is_the_values_own():
    assert mean_interval(np.array([-0.5]), np.zeros(1), low=-1.0)["lower95"] < -0.5
    with pytest.raises(ValueError, match="from 0"):
        mean_interval(np.array([-0.5]), np.zeros(1))


def test_no_frame_says_nothing():
    found = mean_interval(np.array([NAN]), np.zeros(1))
    assert found == {"mean": None, "lower95": None, "upper95": None, "frames": 0, "episodes": 0}
