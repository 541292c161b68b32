"""The worlds as Gymnasium knows environments: one, or many as a vector environment."""

from drone_rl.utils.errors import extra

extra("gymnasium", "gym", "drone_rl.envs.gymnasium")
