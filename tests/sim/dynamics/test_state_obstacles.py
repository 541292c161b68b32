"""Obstacles have the task's positions, and only dynamics that need them receive them."""

import numpy as np
import torch

from drone_rl.config import MOVES_SETTINGS, PillarsSettings
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics import BodyState, Obstacles
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.worlds import Worlds
from tests.fake_flight import FLIGHT, Floating

SETTINGS = PillarsSettings(num_rows=2, width=0.5, height=6.0)


def field(task):
    """Return the state of one environment with obstacles straight ahead."""
    drawn = torch.zeros(1, *task.sample(np.random.RandomState(0)).shape).double()
    return task.start(drawn, BodyState.at_rest(torch.tensor([[0.0, 0.0, 2.5]]).double()))


def test_absent_pillars_are_boxes_far_below():
    task = Pillars(SETTINGS)
    state = field(task)
    state.present[0, 0] = False
    obstacles = task.obstacles(state)
    assert isinstance(obstacles, Obstacles) and obstacles.half_sizes == (0.25, 0.25, 3.0)
    assert obstacles.centers[0, 0].tolist() == [SETTINGS.first_distance, 0.0, 3.0 - 100.0]
    assert obstacles.centers[0, 1].tolist() == [SETTINGS.first_distance, 0.0, 3.0]
    assert obstacles.centers.shape == (1, SETTINGS.num_pillars, 3)


def test_cubes_are_no_obstacles():
    task = CollectCubes()
    assert task.obstacles(field(task)) is None


def test_only_dynamics_that_need_obstacles_receive_them():
    task = Pillars(SETTINGS)
    for needs in (True, False):
        worlds = Worlds(1, task, dynamics=Floating(FLIGHT, MOVES_SETTINGS, needs_obstacles=needs))
        state = field(task)
        state.body = worlds.bodies(1)
        state.body.position[:] = torch.tensor([[SETTINGS.first_distance - 1.0, 0.0, 2.5]])
        after, _ = worlds.advance(state, torch.tensor([0]))
        assert after.body.near.item() == (SETTINGS.num_pillars // SETTINGS.num_rows) * needs


def test_dm_control_passes_obstacles():
    dynamics = Floating(FLIGHT, MOVES_SETTINGS)
    env = make_environment(Pillars(SETTINGS), dynamics=dynamics, pixels=False, random_state=0)
    env.reset()
    row = env.task.state.pillars[0, 0]
    place = [row[0].item() - 1.0, row[1].item(), 2.5]
    env.task.drone.set_pose(env.physics, place, [1.0, 0.0, 0.0, 0.0])
    env.step(0)
    assert env.task.state.body.near.item() >= 1
