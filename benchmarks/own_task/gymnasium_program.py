"""Fly random actions in the task through Gymnasium, and check the environment."""

import json
import sys

import gymnasium
import reach_ball  # noqa: F401 (registers the task)
from gymnasium.utils.env_checker import check_env

check_env(gymnasium.make("drone_rl/ReachBall-v0").unwrapped, skip_render_check=True)
worlds = gymnasium.make_vec("drone_rl/ReachBall-v0", num_envs=16)
worlds.reset(seed=0)
worlds.action_space.seed(0)
episodes = 0
for _ in range(60):
    _, _, terminated, truncated, _ = worlds.step(worlds.action_space.sample())
    episodes += int((terminated | truncated).sum())
sys.stdout.write(json.dumps({"episodes": episodes}))
