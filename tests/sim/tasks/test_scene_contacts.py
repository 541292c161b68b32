"""Tasks of terms in scene files: what stops the drones, and what counts as contact."""

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import torch

from drone_rl import define_task
from drone_rl.config import ActionSettings, CameraSettings, DynamicsSettings
from drone_rl.config.task import TASKS, BaseTaskSettings
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics import Obstacles, Quadrotor
from drone_rl.sim.tasks import ObjectTask
from drone_rl.sim.tasks.fused import fused_rules
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.sim.worlds import Worlds

FORWARD, LEFT, RIGHT = 0, 1, 2
BALL = {"shape": "ball", "role": "goal", "size": [1.0, 1.0, 1.0], "x": 6.0, "y": 0.0, "z": -2.0}
WALL = '<geom name="wall" type="box" size="0.001 5 5" pos="2.5 0 0"/>'


@pytest.fixture(autouse=True, scope="module")
def task():
    """A goal behind a wall of 2 mm; there is no floor, and the drone starts below height 0."""
    kind = define_task(
        "test_walled",
        objects={"ball": BALL},
        reward={"progress": 1.0, "contact": -1.0},
        end=["out_of_bounds"],
        success=["all_goals"],
        start={"x": 0.0, "y": 0.0, "z": -2.0},
        step_limit=50,
    )
    yield
    del TASKS[kind.name], MAKERS[kind]


def settings(folder: Path, *geoms: str) -> BaseTaskSettings:
    """Return settings of the task in one scene for each entry of geoms."""
    files = [folder / f"{i}.xml" for i in range(len(geoms))]
    for file, content in zip(files, geoms, strict=True):
        file.write_text(f"<mujoco><worldbody>{content}</worldbody></mujoco>")
    return BaseTaskSettings.read({"name": "test_walled", "scene": [str(f) for f in files]})


def reset(worlds: Worlds) -> Worlds:
    """Return environments after a reset."""
    worlds.reset(
        torch.arange(worlds.num_envs), [np.random.RandomState(i) for i in range(worlds.num_envs)]
    )
    return worlds


def test_a_thin_wall_ends_a_move_and_counts_as_contact(tmp_path: Path) -> None:
    """The ball of the drone, of 0.4 m, just touches it; along the wall and back it is free."""
    worlds = reset(Worlds(1, settings(tmp_path, WALL)))
    every = torch.arange(1)
    radius = worlds.task.drone_size / 2
    rewards = [float(worlds.step(every, torch.tensor([FORWARD]))) for _ in range(4)]
    x, y, z = worlds.state.drone[0].tolist()
    assert (x, y, z) == pytest.approx((2.499 - radius, 0.0, -2.0), abs=1e-6)
    assert rewards == pytest.approx([1.0, 1.0, x - 2.0 - 1.0, -1.0], abs=1e-6)
    worlds.step(every, torch.tensor([LEFT]))
    assert worlds.state.drone[0].tolist() == pytest.approx((x, 1.0, z), abs=1e-6)


def test_episodes_touch_the_solids_of_their_own_scene(tmp_path: Path) -> None:
    """In one of two scenes there is no wall; the fused kernel refuses both."""
    worlds = reset(
        Worlds(8, settings(tmp_path, WALL, '<geom type="sphere" size="0.1" pos="0 0 9"/>'))
    )
    task, every = cast(ObjectTask, worlds.task), torch.arange(8)
    for _ in range(4):
        worlds.step(every, torch.full((8,), FORWARD))
    is_stopped = worlds.state.drone[:, 0] < 2.5
    state: Any = worlds.state
    scenes = task.scene_of(state)
    assert set(scenes.tolist()) == {0, 1}
    assert torch.equal(is_stopped, scenes == 0)
    assert "scene file" in str(fused_rules(task, worlds.dynamics, worlds.state))


def test_speeds_without_inertia_end_at_the_wall(tmp_path: Path) -> None:
    """At 3 m/s, 0.3 m a step; the velocity of the last step is what is left of it."""
    actions = ActionSettings(kind="velocity", forward_speed=3.0)
    worlds = reset(Worlds(1, settings(tmp_path, WALL), actions=actions))
    ahead = torch.tensor([[1.0, 0.0, 0.0]])
    for _ in range(30):
        worlds.step(torch.arange(1), ahead)
    assert float(worlds.state.drone[0, 0]) == pytest.approx(2.499 - worlds.task.drone_size / 2)
    assert float(worlds.state.body.velocity.norm()) == pytest.approx(0.0, abs=1e-6)


def test_a_quadrotor_bounces_and_slides_as_at_an_obstacle(tmp_path: Path) -> None:
    """The same flight at a wall from a file and at the same box; contact counts in its step.

    Half of the task's drone_size, 0.8 m, is the radius in the file.
    """
    dynamics = DynamicsSettings(mode="simple_flight")
    actions = ActionSettings(kind="velocity")
    wall = '<geom name="wall" type="box" size="0.5 5 8" pos="3 0 0"/>'
    worlds = reset(Worlds(1, settings(tmp_path, wall), dynamics=dynamics, actions=actions))
    quadrotor = Quadrotor(dynamics.replace(radius=0.4), actions)
    box = torch.tensor([[[3.0, 0.0, 100.0]]], dtype=torch.float64)
    body, touches = quadrotor.start(torch.tensor([[0.0, 0.0, 98.0]], dtype=torch.float64)), 0
    action = torch.tensor([[1.0, 0.4, 0.0]])
    for _ in range(40):
        body = quadrotor.step(body, action, Obstacles(box, (0.5, 5.0, 8.0)))
        reward = worlds.step(torch.arange(1), action)
        touches += float(reward) < -0.5
    away = worlds.state.body.position - body.position + torch.tensor([0.0, 0.0, 100.0])
    assert float(away.abs().max()) < 1e-3
    assert float(body.position[0, 1]) > 0.3 and touches > 5


def test_dm_control_is_stopped_by_the_same_wall(tmp_path: Path) -> None:
    """As `Worlds` is."""
    env = make_environment(settings(tmp_path, WALL), random_state=0, pixels=False)
    env.reset()
    rewards = [env.step(FORWARD).reward for _ in range(4)]
    assert rewards == pytest.approx([1.0, 1.0, 0.099 - 1.0, -1.0], abs=1e-6)


@pytest.mark.render
def test_dm_control_draws_what_is_in_the_group_of_the_drone(egl, tmp_path: Path) -> None:
    wall = '<geom name="wall" type="box" size="0.1 5 5" pos="4 0 0" group="1"/>'
    camera = CameraSettings(height=9, width=9, horizontal_fov=90.0)
    env = make_environment(settings(tmp_path, wall), camera, random_state=0)
    assert env.reset().observation["drone/front_center"].all()
