"""Fly random actions in the task through Gymnasium, and check the environment."""

import json
import sys

import reach_ball  # noqa: F401 (registers the task)
from gymnasium.utils.env_checker import check_env

import drone_rl

check_env(drone_rl.DroneWorld(task="reach_ball"), skip_render_check=True)
worlds = drone_rl.DroneWorlds(num_envs=16, task="reach_ball")
worlds.reset(seed=0)
worlds.action_space.seed(0)
episodes = 0
for _ in range(60):
    _, _, terminated, truncated, _ = worlds.step(worlds.action_space.sample())
    episodes += int((terminated | truncated).sum())
sys.stdout.write(json.dumps({"episodes": episodes}))
