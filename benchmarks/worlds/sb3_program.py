"""Train PPO of Stable-Baselines3 in a scene for a few frames, and judge the model."""

import json
import sys

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecTransposeImage

import drone_rl

camera = drone_rl.CameraSettings(width=64, height=40)  # CnnPolicy needs at least 36 x 36 pixels
worlds = gymnasium.make_vec(
    "drone_rl/Reach-v0", num_envs=32, scene=sys.argv[1], camera=camera, autoreset_mode="SameStep"
)
env = VecTransposeImage(VecMonitor(drone_rl.Sb3Worlds(worlds)))
model = PPO("CnnPolicy", env, seed=0, n_steps=64, batch_size=512)
model.learn(4096)
verdict = drone_rl.judge(model, episodes=50)
sys.stdout.write(json.dumps({"episodes": verdict.greedy.episodes}))
