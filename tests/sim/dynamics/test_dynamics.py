"""User-defined dynamics work in batches, dm_control and TorchRL."""

import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.config import MOVES_SETTINGS, DynamicsSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics import ComputerVision, Dynamics, make_dynamics
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state
from tests.composer_env import ComposerEnv
from tests.fake_flight import FLIGHT, Floating, floating
from tests.second_dynamics import TURN, Turning


def test_batch_uses_custom_dynamics():
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


def test_camera_turns_with_the_drone():
    """A cube to the left is out of view, and in the image center after a turn."""
    worlds = Worlds(1, dynamics=Turning())
    cubes = [[0.5, 8.0, 2.5], [0.5, 90.0, 2.5], [0.5, 90.0, 2.5]]
    state = worlds.start(torch.tensor([cubes], dtype=torch.float64))
    view = worlds.view(modality="segmentation")
    seen = {worlds.scene.props[i] for i in worlds.render(state, view).unique() if i >= 0}
    assert seen == {-1}
    turned, _ = worlds.advance(state, torch.tensor([1]))
    assert worlds.scene.props[int(worlds.render(turned, view)[0, 12, 32])] == 0
    worlds.close()


def test_dm_control_reaches_the_same_poses():
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


def test_torchrl_specs_follow_the_dynamics():
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


def test_base_class_has_defaults():
    class Static(Dynamics):
        pass

    static = Static()
    assert (static.mount, static.is_random, static.needs_obstacles) == ("body", False, False)


def test_random_dynamics_are_seeded_by_the_environments_stream():
    gusty = Floating(FLIGHT.replace(gusts=1.0), MOVES_SETTINGS)
    calm = Floating(FLIGHT, MOVES_SETTINGS)
    states = {}
    for name, dynamics in (("gusty", gusty), ("calm", calm)):
        worlds = Worlds(2, dynamics=dynamics)
        worlds.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
        states[name] = worlds.state
    assert torch.equal(states["gusty"].cubes, states["calm"].cubes)  # the task samples first
    expected = []
    for i in range(2):
        stream = world_random_state(0, i)
        CollectCubes().sample(stream)
        expected.append(stream.randint(2**31 - 1))
    assert states["gusty"].body.seed.tolist() == expected
    assert states["calm"].body.seed.tolist() == [0, 0]
    assert worlds.start(states["calm"].cubes).body.seed.tolist() == [0, 0]


def test_dm_control_samples_the_same_seed():
    gusty = Floating(FLIGHT.replace(gusts=1.0), MOVES_SETTINGS)
    env = make_environment(dynamics=gusty, pixels=False, random_state=world_random_state(0, 0))
    env.reset()
    worlds = Worlds(1, dynamics=gusty)
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    assert torch.equal(env.task.state.body.seed, worlds.state.body.seed)
    assert worlds.state.body.seed.item() > 0


@pytest.mark.parametrize("mount", ["gimbal", "body"])
def test_gimbal_keeps_cameras_level(mount):
    dynamics = Floating(FLIGHT.replace(camera_mount=mount), MOVES_SETTINGS)
    worlds = Worlds(1, dynamics=dynamics)
    half = 0.5**0.5
    level = torch.tensor([[half, 0.0, 0.0, half]]).double()  # heading 90 degrees to the left
    tilted = worlds.bodies(1).attitude
    shown = worlds.poses(worlds.state).attitude
    torch.testing.assert_close(shown, level if mount == "gimbal" else tilted)
    torch.testing.assert_close(worlds.state.body.attitude, tilted)
    env = make_environment(dynamics=dynamics, pixels=False, random_state=0)
    env.reset()
    env.step(0)
    torch.testing.assert_close(env.task.state.body.attitude, tilted)
    attitude = torch.tensor(env.task.drone.get_pose(env.physics)[1])[None]
    torch.testing.assert_close(attitude, shown)
    env.task.drone.set_pose(env.physics, [0.0, 0.0, 2.5], [0.0, 0.0, 0.0, 1.0])
    env.step(0)  # after setting the attitude
    assert env.task.state.body.attitude.tolist() == [[0.0, 0.0, 0.0, 1.0]]


def test_settings_are_accepted_in_place_of_dynamics(monkeypatch):
    floating(monkeypatch)
    windy = FLIGHT.replace(wind=(1.0, 0.0, 0.0))
    for made in (
        Worlds(1, dynamics=windy).dynamics,
        DroneEnv(1, dynamics=windy, pixels=False).worlds.dynamics,
        make_environment(dynamics=windy, pixels=False).task.dynamics,
    ):
        assert isinstance(made, Floating) and made.settings == windy
        assert made.action_settings == MOVES_SETTINGS


def test_lost_drone_ends_only_its_own_episode():
    env = DroneEnv(2, dynamics=Floating(FLIGHT, MOVES_SETTINGS), pixels=False)
    state = env.reset()
    for _ in range(6):
        state = env.step(state.set("action", torch.tensor([1, 2])))["next"]
    assert state["info", "end_reason"].flatten().tolist() == [5, 0]
    assert state["terminated"].flatten().tolist() == [True, False]
    env.close()


def test_values_of_another_type_are_named():
    for wrong in ("quadrotor", DynamicsSettings, 5):
        with pytest.raises(InputError, match=r"^dynamics=.* give settings such as drone_rl\.Dyn"):
            make_dynamics(ComputerVision, wrong)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match=r"^actions='moves'"):
        make_dynamics(ComputerVision, None, "moves")  # pyright: ignore[reportArgumentType]
