"""The environments as vector environments of Stable-Baselines3."""

from drone_rl.utils.errors import extra

extra("stable_baselines3", "sb3", "drone_rl.envs.sb3")
