"""Act at random in a scene through Gymnasium, and check the environment."""

import json
import sys

import gymnasium
from gymnasium.utils.env_checker import check_env

import drone_rl  # noqa: F401 (registers the task)

NAME, SCENE = "drone_rl/Reach-v0", sys.argv[1]
check_env(gymnasium.make(NAME, scene=SCENE).unwrapped, skip_render_check=True)
worlds = gymnasium.make_vec(NAME, num_envs=16, scene=SCENE, step_limit=60)
worlds.reset(seed=0)
worlds.action_space.seed(0)
episodes = 0
for _ in range(60):
    _, _, terminated, truncated, _ = worlds.step(worlds.action_space.sample())
    episodes += int((terminated | truncated).sum())
sys.stdout.write(json.dumps({"episodes": episodes}))
