"""The dm_control task: the same episodes as `Worlds`, dm_control's interface, and its images."""

import math

import numpy as np
import pytest
import torch
from dm_control import composer, mjcf
from torchrl.envs.utils import check_env_specs

from benchmarks import speed
from drone_rl.config import ActionSettings, PillarsSettings, TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.sim.actions import Move
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics import Kinematic, Quadrotor
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks.collect_cubes import CollectCubes, CubesEnd
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state
from tests.composer_env import ComposerEnv
from tests.flying import settings

CUBES = TaskSettings(num_cubes=2, first_distance=5.0, spacing=4.0, step_limit=40)
PILLARS = PillarsSettings(num_rows=2)


@pytest.fixture
def env():
    return make_environment(pixels=False, random_state=1)


@pytest.mark.parametrize(
    ("task", "options"),
    [
        (CUBES, {}),
        (PILLARS, {}),
        (CUBES, {"dynamics": settings(gusts=0.5, camera_mount="body")}),
        (PILLARS, {"dynamics": settings(camera_mount="gimbal")}),
        (CUBES, {"dynamics": Quadrotor(settings(), ActionSettings(kind="velocity"))}),
    ],
)
def test_episodes_equal_those_of_the_batch(task, options):
    """States, rewards and ends are the same for the same seeds and actions, bit for bit."""
    source, ends = np.random.RandomState(0), set()
    for seed in range(3 if not options else 1):
        env = make_environment(
            task, pixels=False, random_state=world_random_state(seed, 0), **options
        )
        random_state, worlds = world_random_state(seed, 0), Worlds(1, task, **options)
        entry = worlds.dynamics.actions.entry
        for _ in range(3):  # successive episodes of one environment
            timestep = env.reset()
            worlds.reset(torch.arange(1), [random_state])
            while not timestep.last():
                action = source.choice(3, p=(0.6, 0.2, 0.2)) if not entry.shape else (1, 0.3, -0.2)
                timestep = env.step(action)
                reward = worlds.step(torch.arange(1), torch.tensor([action]).to(entry.dtype))
                assert timestep.reward == reward.item()
                one, many = vars(env.task.state).copy(), vars(worlds.state).copy()
                for state in (one, many):
                    state |= vars(state.pop("body"))
                for name, value in one.items():
                    same = {"rtol": 0, "atol": 0, "equal_nan": True}
                    torch.testing.assert_close(value, many[name], **same)
                poses = worlds.poses(worlds.state)
                position, attitude = env.task.drone.get_pose(env.physics)
                np.testing.assert_array_equal(position, poses.position[0].numpy())
                np.testing.assert_allclose(attitude, poses.attitude[0].numpy(), atol=1e-6)
                np.testing.assert_array_equal(env.physics.data.mocap_pos, poses.props[0].numpy())
            ends.add(worlds.state.end_reason.item())
    assert options or len(ends) >= 2


def test_scene_is_the_dm_control_model_with_semantic_classes():
    env = make_environment(pixels=False, random_state=world_random_state(0, 0))
    env.reset()
    scene, physics = Worlds(1).scene, env.physics.model
    names = [scene.model.geom(i).name for i in range(scene.model.ngeom)]
    assert names == [physics.geom(i).name for i in range(physics.ngeom)]
    parts = dict(zip(names, zip(scene.semantic_classes, scene.props, strict=True), strict=True))
    assert parts.pop("floor") == (SemanticClass.GROUND, -1)
    for i in range(3):
        assert parts.pop(f"cube_{i}/geom") == (SemanticClass.TARGET, i)
    assert parts.pop("drone/hull") == (SemanticClass.DRONE, -1)
    assert set(parts.values()) == {(SemanticClass.DRONE, -1)} and len(parts) == 4  # the rotors


def test_the_boundary_terminates_with_discount_zero(env):
    assert isinstance(env, composer.Environment)
    timestep = env.reset()
    assert timestep.first() and env.action_spec().num_values == 3
    assert env.task.get_reward(env.physics) == 0.0
    while not timestep.last():
        timestep = env.step(Move.FORWARD)
        for name, spec in env.observation_spec().items():
            spec.validate(timestep.observation[name])
    assert timestep.observation["end_reason"].item() == CubesEnd.FRONT_BOUNDARY
    assert timestep.discount == 0.0
    assert env.task.state.steps.item() == 45


def test_the_step_limit_truncates_with_discount_one():
    env = make_environment(TaskSettings(step_limit=32), pixels=False, random_state=0)
    timestep = env.reset()
    for step in range(32):
        timestep = env.step(Move.LEFT if step % 2 else Move.RIGHT)
    assert timestep.last() and timestep.discount == 1.0
    assert timestep.observation["end_reason"].item() == CubesEnd.STEP_LIMIT


def test_externally_moved_drone_collects_a_cube_which_is_then_hidden(env):
    env.reset()
    task, physics = env.task, env.physics
    cube = task.state.places[0, 0].numpy()
    task.drone.set_pose(physics, cube - (1.0, 0.0, 0.0), (1, 0, 0, 0))
    timestep = env.step(Move.FORWARD)
    assert timestep.reward == 1.0
    assert timestep.observation["cubes"].item() == 1
    assert timestep.observation["collected"].tolist() == [True, False, False]
    shown = physics.bind(task.root_entity.mjcf_model.find("geom", "cube_0/geom")).xpos
    assert shown[2] == pytest.approx(cube[2] - HIDDEN_DEPTH)


def test_externally_turned_drone_flies_on_from_its_new_pose():
    env = make_environment(pixels=False, random_state=1, dynamics=settings())
    env.reset()
    half = math.radians(45.0) / 2
    env.task.drone.set_pose(env.physics, (1.0, 2.0, 3.0), (math.cos(half), 0, 0, math.sin(half)))
    env.step(Move.LEFT)
    reference = env.task.state.body.reference
    aside = 0.396 * math.sqrt(0.5)  # to its left, at 4 m/s for 0.099 s
    np.testing.assert_allclose(reference, [[1 - aside, 2 + aside, math.pi / 4, 3]], atol=1e-6)


def test_torchrl_wraps_discrete_and_continuous_actions():
    short = TaskSettings(step_limit=32)
    check_env_specs(ComposerEnv(make_environment(short, pixels=False, random_state=0)))
    dynamics = Kinematic(ActionSettings(kind="velocity"))
    env = ComposerEnv(make_environment(short, pixels=False, random_state=0, dynamics=dynamics))
    check_env_specs(env)
    assert env.action_spec.shape == (3,) and env.action_spec.dtype.is_floating_point


@pytest.mark.render
def test_pixels_through_opengl(egl):
    pixels = make_environment(random_state=0).reset().observation["drone/front_center"]
    assert pixels.shape == (25, 64, 3) and pixels.dtype == np.uint8
    assert pixels.std() > 10


def test_images_of_an_appearance_equal_those_of_the_batch():
    blocks = speed.BLOCKS.replace(camera_turn=((-3.0, -3.0, -3.0), (3.0, 3.0, 3.0)))
    env = make_environment(random_state=world_random_state(0, 0), appearance=blocks)
    ours = DroneEnv(1, appearance=blocks)
    for _ in range(2):
        timestep, images = env.reset(), ours.reset()
        for action in (0, 0, 1):
            seen = timestep.observation["drone/front_center"]
            np.testing.assert_array_equal(seen, images["pixels"][0].numpy())
            timestep = env.step(action)
            images = ours.step(images.set("action", torch.tensor([action])))["next"]
    ours.close()


class Lost(CollectCubes):
    """Its props are of a mesh that is not there."""

    name = "lost"

    def make_props(self):
        return mjcf.RootElement().asset.add("mesh", name="tree", file="no_tree.obj")


def test_a_missing_mesh_is_named_with_the_task_and_its_line():
    with pytest.raises(InputError, match=r"task=lost failed in line \d+ of .*no_tree\.obj"):
        make_environment(Lost(), pixels=False)
