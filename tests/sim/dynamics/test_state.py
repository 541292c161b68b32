"""States of drones, and the obstacles around them."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import MOVES_SETTINGS, PillarsSettings
from drone_rl.sim.dynamics import BodyState, FlightState, Obstacles
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.rendering.appearance import product, turned
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.worlds import Worlds
from tests.fake_flight import FLIGHT, Floating
from tests.flying import doubles


@pytest.mark.parametrize("yaw", [0.0, 40.0, -170.0, 170.0])
def test_the_twist_about_z_has_no_roll_and_pitch(yaw):
    """Attitudes apply roll and pitch first, then yaw."""
    expected = turned("yaw", yaw)[None]
    for roll, pitch in ((0.0, 0.0), (23.0, 0.0), (0.0, -17.0), (-70.0, 0.0)):
        tilted = product(expected, product(turned("pitch", pitch), turned("roll", roll)))
        for sign in (1.0, -1.0):  # both quaternions of one attitude
            twist = twist_about_z(sign * tilted)
            torch.testing.assert_close(twist, sign * expected, atol=1e-12, rtol=0)


def test_inverted_attitude_has_no_heading():
    turned = torch.tensor([[0.0, 1.0, 0.0, 0.0], [0.0, 0.6, 0.8, 0.0]]).double()
    assert twist_about_z(turned).tolist() == [[1.0, 0.0, 0.0, 0.0]] * 2


def test_reference_at_rest_is_the_own_position():
    turned = doubles((math.cos(0.35), 0.0, 0.0, math.sin(0.35)))
    state = FlightState.at_rest(doubles((1.0, 2.0, 3.0)), turned, torch.tensor([5]))
    assert state.position.tolist() == [[1, 2, 3]] and not state.velocity.any()
    assert state.heading.item() == pytest.approx(0.7)
    assert state.reference[0].tolist() == pytest.approx([1.0, 2.0, 0.7, 3.0])
    assert state.numbers[0, fs.SEED] == 5 and not state.is_lost.any()
    assert state.contact.thing.tolist() == [fs.NOTHING] and state.ticks.tolist() == [0]
    assert FlightState.at_rest(doubles((0.0, 0.0, 0.0))).attitude.tolist() == [[1, 0, 0, 0]]


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
