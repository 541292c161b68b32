"""One world in dm_control and many in the batch live by the same rules."""

import numpy as np
import torch

from drone_rl.sim.collect_cubes import make_environment
from drone_rl.sim.rules import EndReason
from drone_rl.sim.settings import TaskSettings
from drone_rl.sim.worlds import CubeWorlds
from drone_rl.utils.seeding import world_random_state


def test_same_seed_and_actions_give_the_same_poses_rewards_and_ends():
    settings = TaskSettings(num_cubes=2, first_distance=5.0, spacing=4.0, step_limit=40)
    actions = np.random.RandomState(0)
    ends = set()
    for seed in range(6):
        env = make_environment(settings, pixels=False, random_state=world_random_state(seed, 0))
        random_state = world_random_state(seed, 0)
        worlds = CubeWorlds(1, settings)
        for _ in range(3):  # episodes of the same world follow one another alike
            timestep = env.reset()
            worlds.reset(torch.arange(1), [random_state])
            while not timestep.last():
                action = actions.choice(3, p=(0.6, 0.2, 0.2))
                timestep = env.step(action)
                reward = worlds.step(torch.arange(1), torch.tensor([action]))
                assert timestep.reward == reward.item()
                for name, value in vars(env.task.state).items():
                    same = {"rtol": 0, "atol": 0, "equal_nan": True, "msg": name}
                    torch.testing.assert_close(value, getattr(worlds.state, name), **same)
                position, _ = env.task.drone.get_pose(env.physics)
                np.testing.assert_array_equal(position, worlds.state.drone[0].numpy())
            ends.add(EndReason(worlds.state.end_reason.item()))
    assert len(ends) >= 2


def test_qpos_is_the_dm_control_models():
    env = make_environment(pixels=False, random_state=world_random_state(0, 0))
    worlds = CubeWorlds(1)
    env.reset()
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    np.testing.assert_allclose(worlds.qpos(worlds.state)[0].numpy(), env.physics.data.qpos)
    assert worlds.model.nq == env.physics.model.nq
    names = [worlds.model.geom(i).name for i in range(worlds.model.ngeom)]
    assert names == [env.physics.model.geom(i).name for i in range(env.physics.model.ngeom)]
