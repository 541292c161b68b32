"""Another way of moving fits wherever computer-vision mode does, and nothing else changes."""

import dataclasses
import math

import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.envs import DroneEnv
from drone_rl.envs.composer_env import ComposerEnv
from drone_rl.sim.actions import DiscreteActions
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state

TURN = math.pi / 2
SPEED = 2.0
"""Metres a second; a step takes 0.1 s."""


class Turning:
    """Flies where its nose points, and turns it: attitude and speeds mean something here."""

    actions = DiscreteActions(
        names=("fly", "turn left", "turn right", "turn round", "hover"),
        mirrored=(0, 2, 1, 3, 4),
        opposite=(0, 2, 1, 3, 4),
        left=1,
        order=(1, 0, 3, 4, 2),
        arrows=((0, 1), (-1, 0), (1, 0), (0, -1), (0, 0)),
        colors=((0, 0, 0),) * 5,
    )

    def start(self, position):
        """Already on its way."""
        body = BodyState.at_rest(position)
        body.velocity[:, 0] = SPEED
        return body

    def step(self, body, action):
        """Turns by a quarter or by half, then flies a tenth of a second."""
        yaw = 2 * torch.atan2(body.attitude[:, 3], body.attitude[:, 0])
        rate = torch.tensor([0.0, TURN, -TURN, 2 * TURN, 0.0], dtype=torch.float64)[action]
        yaw = yaw + rate
        zero = torch.zeros_like(yaw)
        speed = torch.where(action == 4, 0.0, SPEED)
        velocity = torch.stack([yaw.cos() * speed, yaw.sin() * speed, zero], -1)
        return dataclasses.replace(
            body,
            position=body.position + 0.1 * velocity,
            attitude=torch.stack([(yaw / 2).cos(), zero, zero, (yaw / 2).sin()], -1),
            velocity=velocity,
            angular_velocity=torch.stack([zero, zero, rate / 0.1], -1),
        )


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
