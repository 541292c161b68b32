"""What is chosen about motion makes what moves drones."""

import numpy as np
import pytest
import torch

from drone_rl.config import (
    COMPUTER_VISION,
    MOVES_SETTINGS,
    ActionSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics import ComputerVision, Kinematic, Quadrotor, draw_seeds, make_dynamics
from drone_rl.sim.tasks import CollectCubes
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, Floating, floating
from tests.second_dynamics import Turning

TASK = CollectCubes(TaskSettings(step_length=0.5))
VELOCITY = ActionSettings(kind="velocity")


@pytest.mark.parametrize("dynamics", [None, COMPUTER_VISION, DynamicsSettings(mass=0.5)])
@pytest.mark.parametrize("actions", [None, MOVES_SETTINGS, ActionSettings(move_speed=1.0)])
def test_moves_in_computer_vision_mode_are_the_tasks_own_business(dynamics, actions):
    made = make_dynamics(TASK, dynamics, actions)
    assert type(made) is ComputerVision and made.step_length == 0.5
    assert (made.mount, made.is_random, made.needs_obstacles) == ("body", False, False)


def test_what_flies_is_made_of_both(monkeypatch):
    floating(monkeypatch)
    slow = ActionSettings(move_speed=1.0)
    made = make_dynamics(TASK, FLIGHT, slow)
    assert isinstance(made, Floating) and (made.settings, made.action_settings) == (FLIGHT, slow)
    assert make_dynamics(TASK, FLIGHT).action_settings == MOVES_SETTINGS


def test_speeds_in_computer_vision_mode_last_a_control_step():
    made = make_dynamics(TASK, COMPUTER_VISION, VELOCITY)
    assert type(made) is Kinematic and made.timestep == COMPUTER_VISION.control_timestep
    assert made.actions == ContinuousActions.of(VELOCITY)


def test_speeds_are_flown_by_a_drone_with_a_body():
    made = make_dynamics(TASK, FLIGHT, VELOCITY)
    assert type(made) is Quadrotor and made.actions == ContinuousActions.of(VELOCITY)


def test_what_moves_drones_is_taken_as_it_is_and_brings_its_actions():
    turning = Turning()
    assert make_dynamics(TASK, turning) is turning
    with pytest.raises(InputError, match=r"^actions=velocity, but dynamics=Turning brings its own"):
        make_dynamics(TASK, turning, VELOCITY)


def test_seeds_are_one_of_each_stream():
    streams = [np.random.RandomState(i) for i in (3, 4)]
    seeds = draw_seeds(streams)
    expected = [np.random.RandomState(i).randint(2**31 - 1) for i in (3, 4)]
    assert seeds.tolist() == expected and seeds.dtype == torch.int64
