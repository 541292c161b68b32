"""Creation of dynamics from settings."""

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


def test_seeds_come_from_each_stream():
    streams = [np.random.RandomState(i) for i in (3, 4)]
    seeds = draw_seeds(streams)
    expected = [np.random.RandomState(i).randint(2**31 - 1) for i in (3, 4)]
    assert seeds.tolist() == expected and seeds.dtype == torch.int64
