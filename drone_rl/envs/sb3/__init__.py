"""The worlds as Stable-Baselines3 knows environments."""

from drone_rl.utils.errors import extra

extra("stable_baselines3", "sb3", "drone_rl.envs.sb3")
