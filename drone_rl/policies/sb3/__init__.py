"""Our network in Stable-Baselines3's policies, and their policies as networks of ours."""

from drone_rl.utils.errors import extra

extra("stable_baselines3", "sb3", "drone_rl.policies.sb3")
