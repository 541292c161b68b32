"""Dynamics without inertia, dynamics of a user, and the choice by settings."""

import math

import pytest
import torch

from drone_rl.config import (
    COMPUTER_VISION,
    MOVES_SETTINGS,
    ActionSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.sim.actions import Move
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics import (
    ComputerVision,
    Kinematic,
    Quadrotor,
    make_dynamics,
)
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state
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


def test_random_dynamics_are_seeded_by_the_environments_stream():
    gusty = Floating(FLIGHT.replace(gusts=1.0), MOVES_SETTINGS)
    calm = Floating(FLIGHT, MOVES_SETTINGS)
    states = {}
    for name, dynamics in (("gusty", gusty), ("calm", calm)):
        worlds = Worlds(2, dynamics=dynamics)
        worlds.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
        states[name] = worlds.state
    assert torch.equal(states["gusty"].places, states["calm"].places)  # the task samples first
    expected = []
    for i in range(2):
        stream = world_random_state(0, i)
        CollectCubes().sample(stream)
        expected.append(stream.randint(2**31 - 1))
    assert states["gusty"].body.seed.tolist() == expected
    assert states["calm"].body.seed.tolist() == [0, 0]
    assert worlds.start(states["calm"].places).body.seed.tolist() == [0, 0]


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


def test_values_of_another_type_are_named():
    for wrong in ("quadrotor", DynamicsSettings, 5):
        with pytest.raises(InputError, match=r"^dynamics=.* give settings such as drone_rl\.Dyn"):
            make_dynamics(ComputerVision, wrong)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match=r"^actions='moves'"):
        make_dynamics(ComputerVision, None, "moves")  # pyright: ignore[reportArgumentType]


TASK = CollectCubes(TaskSettings(step_length=0.5))


VELOCITY = ActionSettings(kind="velocity")


@pytest.mark.parametrize("dynamics", [None, COMPUTER_VISION, DynamicsSettings(mass=0.5)])
@pytest.mark.parametrize("actions", [None, MOVES_SETTINGS, ActionSettings(move_speed=1.0)])
def test_computer_vision_moves_use_the_tasks_step(dynamics, actions):
    made = make_dynamics(TASK.make_dynamics, dynamics, actions)
    assert type(made) is ComputerVision and made.step_length == 0.5
    assert (made.mount, made.is_random, made.needs_obstacles) == ("body", False, False)


def test_quadrotor_uses_dynamics_and_action_settings(monkeypatch):
    floating(monkeypatch)
    slow = ActionSettings(move_speed=1.0)
    made = make_dynamics(TASK.make_dynamics, FLIGHT, slow)
    assert isinstance(made, Floating) and (made.settings, made.action_settings) == (FLIGHT, slow)
    assert make_dynamics(TASK.make_dynamics, FLIGHT).action_settings == MOVES_SETTINGS


def test_computer_vision_velocities_last_one_control_step():
    made = make_dynamics(TASK.make_dynamics, COMPUTER_VISION, VELOCITY)
    assert type(made) is Kinematic and made.timestep == COMPUTER_VISION.control_timestep
    assert made.actions == ContinuousActions.of(VELOCITY)


def test_velocities_are_supported_by_the_quadrotor():
    made = make_dynamics(TASK.make_dynamics, FLIGHT, VELOCITY)
    assert type(made) is Quadrotor and made.actions == ContinuousActions.of(VELOCITY)


def test_dynamics_objects_are_used_with_their_actions():
    turning = Turning()
    assert make_dynamics(TASK.make_dynamics, turning) is turning
    with pytest.raises(InputError, match=r"^actions=velocity, but dynamics=Turning brings its own"):
        make_dynamics(TASK.make_dynamics, turning, VELOCITY)


def test_moves_are_one_meter_forward_left_and_right():
    body = ComputerVision().start(torch.zeros(3, 3, dtype=torch.float64))
    moved = ComputerVision().step(body, torch.tensor([Move.FORWARD, Move.LEFT, Move.RIGHT]))
    assert moved.position.tolist() == [[1, 0, 0], [0, 1, 0], [0, -1, 0]]
    assert moved.attitude.tolist() == [[1, 0, 0, 0]] * 3
    assert not moved.velocity.any() and not moved.angular_velocity.any()
    assert not body.position.any()  # the input is unchanged
    half = ComputerVision(0.5).step(moved, torch.tensor([Move.LEFT] * 3))
    assert half.position.tolist() == [[1, 0.5, 0], [0, 1.5, 0], [0, -0.5, 0]]


FULL = ActionSettings(kind="moves_full", turn_step=90.0)


def moved(*names, settings=FULL, start=(0.0, 0.0, 2.0)):
    """Return a drone after moves of half a metre."""
    dynamics = make_dynamics(TASK.make_dynamics, None, settings)
    body = dynamics.start(torch.tensor([start], dtype=torch.float64))
    for name in names:
        body = dynamics.step(body, dynamics.actions.always(name)[None])
    return body


def test_moves_go_along_the_heading():
    """Of the world: forward is +y after a turn to the left, left is -x, right +x, back -y."""
    there = moved("up", "turn left", "forward", "forward", "left", "back", "down", "down")
    torch.testing.assert_close(there.position, torch.tensor([[-0.5, 0.5, 1.5]]).double())
    torch.testing.assert_close(there.attitude, torch.tensor([[0.5**0.5, 0, 0, 0.5**0.5]]).double())
    beside = moved("turn right", "forward", "turn right", "forward").position
    torch.testing.assert_close(beside, torch.tensor([[-0.5, -0.5, 2.0]]).double())


def test_turns_of_the_step_add_up():
    """24 turns of 15 degrees are a whole one, after which forward is +x again."""
    turning = ActionSettings(kind="moves_turning")
    assert turning.turn_step == 15.0
    quarter = moved(*["turn left"] * 6, "forward", settings=turning)
    torch.testing.assert_close(quarter.position, torch.tensor([[0.0, 0.5, 2.0]]).double())
    whole = moved(*["turn left"] * 24, "forward", settings=turning)
    torch.testing.assert_close(whole.position, torch.tensor([[0.5, 0.0, 2.0]]).double())
    assert moved(*["turn right"] * 24, settings=turning).attitude.norm().item() == pytest.approx(1)


def test_moves_of_turned_drones_go_along_the_heading_too():
    """A start to the left of the world's x: "moves" has no turns of its own."""
    dynamics = make_dynamics(TASK.make_dynamics)
    left = torch.tensor([[0.5**0.5, 0.0, 0.0, 0.5**0.5]] * 2, dtype=torch.float64)
    body = dynamics.start(torch.zeros(2, 3).double()).moved(torch.zeros(2, 3).double(), left)
    after = dynamics.step(body, torch.tensor([Move.FORWARD, Move.RIGHT]))
    torch.testing.assert_close(after.position, torch.tensor([[0, 0.5, 0], [0.5, 0, 0]]).double())


def test_a_mirrored_episode_has_the_mirrored_actions_bit_for_bit():
    actions = make_dynamics(TASK.make_dynamics, None, FULL.replace(turn_step=11.0)).actions
    names = [actions.names[i] for i in actions.sample((40,), torch.Generator().manual_seed(0))]
    images = [actions.names[actions.mirrored[actions.names.index(name)]] for name in names]
    settings = FULL.replace(turn_step=11.0)
    one, other = moved(*names, settings=settings), moved(*images, settings=settings)
    assert torch.equal(one.position * torch.tensor([1, -1, 1]), other.position)
    assert torch.equal(one.attitude * torch.tensor([1, 1, 1, -1]), other.attitude)


def test_moves_need_a_task_with_moves():
    with pytest.raises(InputError, match=r"^actions=moves_full needs a task with moves"):
        make_dynamics(Turning, None, FULL)
    with pytest.raises(InputError, match=r"^yaw_rate=0.0 is none for the turns of actions=moves_"):
        FULL.replace(yaw_rate=0.0)


SETTINGS = ActionSettings(kind="velocity", forward_speed=4, sideways_speed=3, yaw_rate=90)


def flown(*actions, timestep=0.1):
    dynamics = Kinematic(SETTINGS, timestep)
    body = dynamics.start(torch.tensor([[1.0, 2.0, 3.0]], dtype=torch.float64))
    for action in actions:
        body = dynamics.step(body, torch.tensor([action], dtype=torch.float32))
    return body


def test_step_length_follows_from_the_velocity():
    body = flown((0.0, 0.5, 0.0))
    assert body.position[0].tolist() == pytest.approx([1.2, 2.15, 3.0])  # 2 and 1.5 m/s
    assert body.velocity[0].tolist() == pytest.approx([2.0, 1.5, 0.0])
    assert body.attitude.tolist() == [[1, 0, 0, 0]]
    assert flown((-1.0, 0.0, 0.0)).position.tolist() == [[1.0, 2.0, 3.0]]
    assert flown((1.0, 0.0, 0.0), timestep=0.5).position[0, 0] == 3.0


def test_climb_and_backward_are_flown():
    settings = SETTINGS.replace(climb_speed=2.0, backward_speed=1.0)
    dynamics = Kinematic(settings, timestep=0.5)
    body = dynamics.start(torch.tensor([[1.0, 2.0, 3.0]], dtype=torch.float64))
    body = dynamics.step(body, torch.tensor([[-1.0, 0.0, 0.0, 0.5]]))  # -1 m/s, and 1 m/s up
    assert body.position[0].tolist() == pytest.approx([0.5, 2.0, 3.5])
    assert body.velocity[0].tolist() == pytest.approx([-1.0, 0.0, 1.0])
    drone = Quadrotor(FLIGHT, settings)
    flown = drone.start(torch.tensor([[0.0, 0.0, 10.0]], dtype=torch.float64))
    for _ in range(40):
        flown = drone.step(flown, torch.tensor([[-1.0, 0.0, 0.0, 0.5]]))
    assert flown.velocity[0].tolist() == pytest.approx([-1.0, 0.0, 1.0], abs=0.15)


def test_turn_takes_effect_in_the_next_step():
    """1 s at 90 degrees/s, then 4 m/s forward, which is world left, and left, which is back."""
    turned = flown((-1.0, 0.0, 1.0), timestep=1.0)
    assert turned.angular_velocity[0].tolist() == pytest.approx([0, 0, math.pi / 2])
    half = math.sqrt(0.5)
    assert turned.attitude[0].tolist() == pytest.approx([half, 0, 0, half])
    assert turned.position.tolist() == [[1.0, 2.0, 3.0]]
    there = flown((-1.0, 0.0, 1.0), (1.0, 1.0, 0.0), timestep=1.0)
    assert there.position[0].tolist() == pytest.approx([-2.0, 6.0, 3.0])
