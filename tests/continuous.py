"""One cube near by, flown to at speeds that are drawn: what continuous actions are tried on."""

import torch

from drone_rl.config import ActionSettings, CameraSettings, TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
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


def make_worlds(num_envs=8, seed=0, **actions):
    """Environment of few pixels; a step takes a quarter of a second."""
    dynamics = Kinematic(SETTINGS.replace(**actions), 0.25)
    env = DroneEnv(num_envs, TASK, CAMERA, dynamics=dynamics, seed=seed, num_shards=1)
    return with_transforms(env, [GrayPixels(), StandardizePixels()])


def make_policy(env, seed=0):
    """A small network and an actor of it."""
    generator = torch.Generator().manual_seed(seed)
    network = SmallCNN((1, 8, 32), 6, channels=(8,), hidden=(32,), generator=generator)
    network.actions = env.base_env.worlds.dynamics.actions
    return network, make_actor(network, env.action_spec, generator)
