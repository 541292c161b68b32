"""Hand-computed goals of actions."""

import math

import pytest
import torch

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import FlightState, Mode, Quadrotor
from drone_rl.sim.dynamics.control import Moves, Velocities

MOVES = ActionSettings(move_speed=4.0, move_lead=0.5)
VELOCITY = ActionSettings(kind="velocity", forward_speed=4, sideways_speed=3, yaw_rate=90)


def drones():
    place = torch.tensor([[1.0, 2.0, 2.5]] * 3, dtype=torch.float64)
    return FlightState.at_rest(place)


def test_move_shifts_the_position_goal():
    goals = Moves(MOVES).goals(drones(), torch.tensor([Move.FORWARD, Move.LEFT, Move.RIGHT]))
    assert goals.modes == (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
    assert goals.values.tolist() == [[1.0, 2.0, 0.0, 2.5]] * 3
    assert goals.drifts.tolist() == [[4, 0, 0, 0], [0, 4, 0, 0], [0, -4, 0, 0]]


def test_position_goal_stays_within_its_lead():
    body = drones()
    body.reference[:] = torch.tensor([[1.3, 9.0, 0.1, 2.5], [-7.0, 1.8, 0.1, 2.5], [1, 2, 0.1, 3]])
    goals = Moves(MOVES).goals(body, torch.zeros(3, dtype=torch.int64))
    expected = [[1.3, 2.5, 0.1, 2.5], [0.5, 1.8, 0.1, 2.5], [1.0, 2.0, 0.1, 3.0]]
    assert goals.values.tolist() == [pytest.approx(row) for row in expected]
    assert body.reference[0, 1] == 9.0


def test_velocity_actions_use_the_heading_frame_and_keep_height():
    body = drones()
    body.reference[:, 3] = 2.0
    action = torch.tensor([[-1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, -0.5, -2.0]])
    goals = Velocities(VELOCITY).goals(body, action)
    assert goals.modes == (
        Mode.HEADING_VELOCITY,
        Mode.HEADING_VELOCITY,
        Mode.RATE,
        Mode.POSITION,
    )
    turn = math.pi / 2
    expected = [[0, 0, 0, 2.0], [4, 3, turn, 2.0], [2, -1.5, -turn, 2.0]]
    assert goals.values.tolist() == [pytest.approx(row) for row in expected]
    assert goals.drift is None


def test_settings_select_the_steering():
    flight = DynamicsSettings(mode="simple_flight")
    assert isinstance(Quadrotor(flight, MOVES).steering, Moves)
    assert Quadrotor(flight, VELOCITY).actions.names[3] == "turn left"
