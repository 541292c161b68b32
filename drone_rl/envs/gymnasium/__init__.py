"""The environments as Gymnasium environments: single and vector."""

from drone_rl.utils.errors import extra

extra("gymnasium", "gym", "drone_rl.envs.gymnasium")
