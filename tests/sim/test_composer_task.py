import math

import numpy as np
import pytest
import torch
from dm_control import composer, mjcf

from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.sim import entities
from drone_rl.sim.actions import Move
from drone_rl.sim.composer_task import ComposerTask, make_environment
from drone_rl.sim.tasks.collect_cubes import CollectCubes, EndReason
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.utils.errors import InputError


@pytest.fixture
def env():
    return make_environment(pixels=False, random_state=1)


def test_runs_under_plain_composer_environment(env):
    assert isinstance(env, composer.Environment)
    timestep = env.reset()
    assert timestep.first()
    assert env.action_spec().num_values == 3
    while not timestep.last():
        timestep = env.step(Move.FORWARD)
        for name, spec in env.observation_spec().items():
            spec.validate(timestep.observation[name])
    assert timestep.observation["end_reason"].item() == EndReason.FRONT_BOUNDARY
    assert timestep.discount == 0.0
    assert env.task.state.steps.item() == 45


def test_step_limit_truncates_with_discount_one():
    env = make_environment(TaskSettings(step_limit=32), pixels=False, random_state=0)
    timestep = env.reset()
    for step in range(32):
        timestep = env.step(Move.LEFT if step % 2 else Move.RIGHT)
    assert timestep.last()
    assert timestep.discount == 1.0
    assert timestep.observation["end_reason"].item() == EndReason.STEP_LIMIT


def test_externally_moved_drone_collects_cubes(env):
    env.reset()
    task, physics = env.task, env.physics
    cube = task.state.cubes[0, 0].numpy()
    task.drone.set_pose(physics, cube - (1.0, 0.0, 0.0), (1, 0, 0, 0))
    timestep = env.step(Move.FORWARD)
    assert timestep.reward == 1.0
    assert timestep.observation["cubes"].item() == 1
    assert timestep.observation["collected"].tolist() == [True, False, False]


def test_collected_cube_is_hidden(env):
    env.reset()
    place = env.task.state.cubes[0, 0].numpy()
    env.task.drone.set_pose(env.physics, place - (1.0, 0.0, 0.0), (1, 0, 0, 0))
    env.step(Move.FORWARD)
    shown = env.physics.bind(env.task.root_entity.mjcf_model.find("geom", "cube_0/geom")).xpos
    assert shown[2] == pytest.approx(place[2] - HIDDEN_DEPTH)


def test_physics_does_not_move_the_drone(env):
    env.reset()
    for action in (Move.FORWARD, Move.FORWARD, Move.LEFT, Move.RIGHT, Move.RIGHT):
        env.step(action)
    position, quaternion = env.task.drone.get_pose(env.physics)
    np.testing.assert_allclose(position, (2.0, -1.0, 2.5), atol=1e-12)
    np.testing.assert_allclose(quaternion, (1, 0, 0, 0), atol=1e-12)


def test_seed_determines_the_sequence_of_episodes():
    def places(seed, episodes=3):
        env = make_environment(pixels=False, random_state=seed)
        return [env.reset() and env.task.state.cubes.numpy().copy() for _ in range(episodes)]

    first, again, other = places(5), places(5), places(6)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[0], first[1])
    assert not np.array_equal(first[0], other[0])


def test_five_cameras_with_airsims_names():
    model = ComposerTask(pixels=False).drone.mjcf_model
    names = [spec.name for spec in entities.DRONE_CAMERAS]
    assert names == ["front_center", "front_right", "front_left", "bottom_center", "back_center"]
    assert all(model.find("camera", name) is not None for name in names)


def test_observables_are_off_until_a_task_enables_them():
    from drone_rl.config import CameraSettings
    from drone_rl.sim.entities import Drone

    drone = Drone(size=0.8, camera=CameraSettings())
    assert not any(o.enabled for o in drone.observables.as_dict().values())


@pytest.mark.render
def test_pixels_through_opengl(egl):
    env = make_environment(random_state=0)
    timestep = env.reset()
    pixels = timestep.observation["drone/front_center"]
    assert pixels.shape == (25, 64, 3)
    assert pixels.dtype == np.uint8
    assert pixels.std() > 10


@pytest.mark.parametrize("mount", ["gimbal", "body"])
def test_gimballed_cameras_stay_level_and_body_cameras_tilt(mount):
    flying = DynamicsSettings(mode="simple_flight", camera_mount=mount)
    task = ComposerTask(pixels=False, dynamics=flying)
    body = task.state.body
    half = 0.3  # pitch only
    body.attitude[:] = torch.tensor([np.cos(half), 0.0, np.sin(half), 0.0])
    level = torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64)
    expected = level if mount == "gimbal" else body.attitude
    torch.testing.assert_close(task._shown(body), expected, check_dtype=False)


def test_reward_before_the_first_step_is_zero(env):
    env.reset()
    assert env.task.get_reward(env.physics) == 0.0


def test_unmoved_drone_keeps_the_exact_position(env):
    env.reset()
    env.step(Move.LEFT)
    body = env.task.state.body
    assert env.task._found(env.physics) is body
    env.task.drone.set_pose(env.physics, body.position[0].numpy() + 0.5)
    assert (env.task._found(env.physics).position - body.position == 0.5).all()


def test_a_turned_drone_has_the_new_attitude(env):
    env.reset()
    body, half = env.task.state.body, math.radians(45.0) / 2
    turned = [math.cos(half), 0.0, 0.0, math.sin(half)]
    env.task.drone.set_pose(env.physics, body.position[0].numpy(), turned)
    assert env.task._found(env.physics).attitude[0].tolist() == pytest.approx(turned)


class Lost(CollectCubes):
    """Its props are of a mesh that is not there."""

    name = "lost"

    def make_props(self):
        return mjcf.RootElement().asset.add("mesh", name="tree", file="no_tree.obj")


def test_a_missing_mesh_is_named_with_the_task_and_its_line():
    with pytest.raises(
        InputError,
        match=r"^task=lost failed in line \d+ of .*test_composer_task\.py \(.*no_tree\.obj.*\); c",
    ):
        make_environment(Lost(), pixels=False)


def test_distractors_without_an_appearance_are_out_of_sight():
    env = make_environment(pixels=False, distractors=2, random_state=0)
    env.reset()
    env.step(0)
    *_, first, second = env.task._frames
    heights = [float(env.physics.bind(frame).mocap_pos[2]) for frame in (first, second)]
    assert heights == [-HIDDEN_DEPTH] * 2
    env.close()
