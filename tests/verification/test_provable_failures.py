"""Failures found by flying are those that the rules say."""

import numpy as np

from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import constant_policy
from drone_rl.sim.actions import Move
from drone_rl.utils.seeding import world_random_state
from drone_rl.verification.provable import find_failures

TASK = TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60)


def flown(num_episodes, enough):
    env = DroneEnv(8, TASK, seed=4, pixels=False)
    try:
        return find_failures(env, constant_policy(Move.FORWARD), num_episodes, enough)
    finally:
        env.close()


def test_straight_ahead_fails_where_the_cube_is_aside():
    places, episodes = flown(20, 1000)
    assert episodes == 24  # whole batches
    worlds = [world_random_state(4, i) for i in range(8)]
    drawn = [w.uniform(-1.0, 1.0, size=(1, 2))[0, 0] * 6.0 for _ in range(3) for w in worlds]
    aside = [y for y in drawn if abs(y) > TASK.touch_distance]
    assert 0 < len(aside) < 24
    np.testing.assert_allclose(places[:, 0], aside, rtol=1e-6)


def test_enough_is_enough():
    places, episodes = flown(1000, 1)
    assert episodes == 8 and 0 < len(places) <= 8
