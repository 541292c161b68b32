"""Training with Stable-Baselines3, and the running mean that stops it."""

import numpy as np
import pytest

from drone_rl.utils.errors import InputError

pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from benchmarks.peers.sb3 import Solved, train_sb3


def test_the_running_mean_counts_whole_episodes_in_the_order_of_their_ends():
    solved = Solved(target=2.0, decay=0.5)
    solved.count(np.array([1.0, 0.0]), np.array([False, False]))
    assert (solved.running_reward, solved.episodes) == (0.0, 0)
    solved.count(np.array([2.0, 1.0]), np.array([True, True]))  # episodes of 3 and of 1
    assert (solved.running_reward, solved.episodes) == ((0.5 * 3) * 0.5 + 0.5 * 1, 2)
    solved.count(np.array([1.0, 2.0]), np.array([False, True]))  # one of 2
    assert (solved.running_reward, solved.is_reached) == (1.625, False)
    solved.count(np.array([2.0, 0.0]), np.array([True, False]))  # one of 3
    assert (solved.running_reward, solved.is_reached) == (2.3125, True)


def test_459_perfect_episodes_reach_the_target():
    solved = Solved(target=2.97)
    while not solved.is_reached:
        solved.count(np.array([3.0]), np.array([True]))
    assert solved.episodes == 459  # 1 - 0.99^459 is above 0.99


@pytest.mark.parametrize(
    ("algorithm", "settings"),
    [("ppo", {"n_steps": 16, "batch_size": 32}), ("a2c", {})],
)
def test_training_stops_at_frames_or_target_and_returns_a_policy(algorithm, settings):
    settings = {"num_envs": 4, **settings}
    done = train_sb3(algorithm, 3, max_frames=64, **settings)
    again = train_sb3(algorithm, 3, max_frames=64, **settings)
    assert (done.is_solved, [r for _, r in done.history]) == (False, [r for _, r in again.history])
    assert done.frames >= 64
    times = [at for at, _ in done.history]
    assert len(times) == 1 + done.frames // (4 * settings.get("n_steps", 5)) and times == sorted(
        times
    )
    ours, theirs = (t.policy.make_network() for t in (done, again))
    weights = zip(ours.parameters(), theirs.parameters(), strict=True)
    assert all(one.equal(other) for one, other in weights)
    assert (done.policy.name, ours.in_shape) == (f"sb3 {algorithm}", (1, 25, 64))
    with done.policy.flying(2) as (env, actor):
        assert actor(env.reset())["action"].shape == (2,)
    at_once = train_sb3(algorithm, 3, target=0.0, **settings)
    assert (at_once.is_solved, at_once.frames) == (True, 4)


def test_an_unknown_algorithm_is_an_error():
    with pytest.raises(InputError, match=r"^algorithm='dqn' is unknown; give ppo, a2c$"):
        train_sb3("dqn", 0)
