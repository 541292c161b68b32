import torch
from torchrl.envs.utils import check_env_specs

import drone_rl
from drone_rl.settings.transforms import Gray, Resize


def test_worlds_as_policies_see_them():
    env = drone_rl.make_env(2, task=drone_rl.TaskSettings(num_cubes=2), seed=3)
    assert env.reset()["pixels"].shape == (2, 1, 25, 64)
    assert env.reset()["info", "cube_positions"].shape == (2, 2, 3)
    check_env_specs(env)
    env.close()


def test_other_pictures():
    camera = drone_rl.CameraSettings(width=20, height=10)
    env = drone_rl.make_env(1, camera=camera, transforms=[Gray(), Resize(height=5, width=8)])
    assert env.reset()["pixels"].shape == (1, 1, 5, 8)
    env.close()


def test_a_seed_means_the_same_worlds():
    found = []
    for _ in range(2):
        env = drone_rl.make_env(2, seed=7)
        found.append(env.reset()["info", "cube_positions"])
        env.close()
    assert torch.equal(*found)
