"""A small environment with one close cube and continuous actions."""

import torch

from drone_rl.config import ActionSettings, CameraSettings, TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.policies import SmallCNN, make_actor
from drone_rl.sim.dynamics import Kinematic

SETTINGS = ActionSettings(kind="velocity")
TASK = TaskSettings(
    num_cubes=1,
    first_distance=6.0,
    lateral_bound=4.0,
    front_margin=3.0,
    side_margin=3.0,
    step_limit=40,
)
CAMERA = CameraSettings(width=32, height=8)


def make_env(num_envs=8, seed=0, **actions):
    """Return an environment with small images and a control step of 0.25 s."""
    dynamics = Kinematic(SETTINGS.replace(**actions), 0.25)
    transforms = [GrayPixels(), StandardizePixels()]
    return DroneEnv(
        num_envs, TASK, CAMERA, transforms=transforms, dynamics=dynamics, seed=seed, num_shards=1
    )


def make_policy(env, seed=0):
    """Return a small network and its actor."""
    generator = torch.Generator().manual_seed(seed)
    network = SmallCNN((1, 8, 32), 6, channels=(8,), hidden=(32,), generator=generator)
    network.actions = env.base_env.worlds.dynamics.actions
    return network, make_actor(network, env.action_spec, generator)
