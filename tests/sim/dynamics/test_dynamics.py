"""Another way of moving fits wherever computer-vision mode does, and nothing else changes."""

import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.envs import DroneEnv
from drone_rl.envs.composer_env import ComposerEnv
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state
from tests.second_dynamics import TURN, Turning


def test_the_batch_flies_it():
    worlds = Worlds(2, dynamics=Turning())
    worlds.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
    for actions in ([1, 0], [0, 4], [3, 0]):
        worlds.step(torch.arange(2), torch.tensor(actions))
    body = worlds.state.body
    expected = torch.tensor([[0.0, 0.2, 2.5], [0.4, 0.0, 2.5]], dtype=torch.float64)
    torch.testing.assert_close(body.position, expected)
    torch.testing.assert_close(body.velocity[0], torch.tensor([0.0, -2.0, 0.0]).double())
    assert body.angular_velocity[0, 2].item() == pytest.approx(20 * TURN)
    worlds.close()


def test_the_camera_turns_with_the_drone():
    """A cube at the drone's left is unseen, and in the middle of the picture after a turn."""
    worlds = Worlds(1, dynamics=Turning())
    cubes = [[0.5, 8.0, 2.5], [0.5, 90.0, 2.5], [0.5, 90.0, 2.5]]
    state = worlds.start(torch.tensor([cubes], dtype=torch.float64))
    view = worlds.view(modality="segmentation")
    seen = {worlds.scene.props[i] for i in worlds.render(state, view).unique() if i >= 0}
    assert seen == {-1}
    turned, _ = worlds.advance(state, torch.tensor([1]))
    assert worlds.scene.props[int(worlds.render(turned, view)[0, 12, 32])] == 0
    worlds.close()


def test_dm_control_flies_it_to_the_same_poses():
    env = make_environment(dynamics=Turning(), pixels=False, random_state=world_random_state(0, 0))
    worlds = Worlds(1, dynamics=Turning())
    env.reset()
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    assert env.action_spec().num_values == 5
    for action in (0, 1, 0, 3, 2, 4, 0):
        env.step(action)
        worlds.step(torch.arange(1), torch.tensor([action]))
        for name, value in vars(worlds.state.body).items():
            found = getattr(env.task.state.body, name)
            torch.testing.assert_close(found, value, atol=1e-12, rtol=0, msg=name)
    position, attitude = env.task.drone.get_pose(env.physics)
    torch.testing.assert_close(torch.tensor(position)[None], worlds.state.body.position)
    torch.testing.assert_close(torch.tensor(attitude)[None], worlds.state.body.attitude)


def test_torchrl_sees_its_actions_and_its_attitude():
    env = DroneEnv(2, dynamics=Turning())
    check_env_specs(env)
    assert env.action_spec.space.n == 5
    state = env.reset()
    after = env.step(state.set("action", torch.tensor([1, 0])))["next", "info"]
    torch.testing.assert_close(
        after["attitude"], torch.tensor([[0.5**0.5, 0, 0, 0.5**0.5], [1, 0, 0, 0]])
    )
    torch.testing.assert_close(after["drone"][:, :2], torch.tensor([[0.0, 0.2], [0.2, 0.0]]))
    env.close()
    single = make_environment(dynamics=Turning(), pixels=False, random_state=0)
    assert ComposerEnv(single).action_spec.space.n == 5
