"""Setpoints from goals, computed by hand. AirSim: 0.25 of 6 m/s per metre, 4 m/s upwards."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.flight.in_the_loop.control import setpoint_of
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode, Quadrotor
from drone_rl.utils.errors import InputError

SETTINGS = DynamicsSettings(mode="simple_flight")


def readings(position=(0.0, 0.0, 2.0), heading=0.0):
    zeros = np.zeros(3)
    attitude = np.array([math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)])
    return Readings(0.0, np.array(position), zeros, attitude, zeros, zeros)


def body():
    return FlightState.at_rest(torch.tensor([[0.0, 0.0, 2.0]], dtype=torch.float64))


def goals_of(actions, action):
    return Quadrotor(SETTINGS, actions).steering.goals(body(), action)


def test_a_move_is_a_place_that_drifts():
    """At 4 m/s; after 0.05 s it is 0.2 m ahead: 0.25 * 6 * 0.2 = 0.3 m/s more."""
    left = goals_of(ActionSettings(), torch.tensor([1]))
    first = setpoint_of(left, 0.0, readings(), SETTINGS)
    assert (*first.velocity, first.heading, first.yaw_rate) == (0.0, 4.0, 0.0, 0.0, None)
    later = setpoint_of(left, 0.05, readings(), SETTINGS)
    assert later.velocity == pytest.approx((0.0, 4.3, 0.0))
    far = setpoint_of(left, 0.0, readings((0.0, -9.0, 1.9)), SETTINGS)
    assert far.velocity == pytest.approx((0.0, 6.0, 0.1))  # its limit; 0.25 * 4 * 0.1 upwards


def test_speeds_go_with_the_heading():
    """Full speed forward and half to the left, of who looks to the left; half the rate of 45."""
    told = goals_of(ActionSettings(kind="velocity"), torch.tensor([[1.0, 0.5, -0.5]]))
    setpoint = setpoint_of(told, 0.05, readings(heading=math.pi / 2), SETTINGS)
    assert setpoint.velocity == pytest.approx((-1.5, 4.0, 0.0))
    assert setpoint.yaw_rate == pytest.approx(-math.radians(22.5))


def test_velocities_of_the_world():
    modes = (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.VELOCITY)
    told = FlightGoals(modes, torch.tensor([[1.0, 2.0, 0.3, 9.0]], dtype=torch.float64))
    setpoint = setpoint_of(told, 1.0, readings(heading=1.0), SETTINGS)
    assert (*setpoint.velocity, setpoint.heading) == pytest.approx((1.0, 2.0, 4.0, 0.3))


def test_angles_are_no_setpoint():
    modes = (Mode.ANGLE, Mode.ANGLE, Mode.RATE, Mode.THROTTLE)
    told = FlightGoals(modes, torch.zeros(1, 4, dtype=torch.float64))
    with pytest.raises(InputError, match="angle, angle, rate, throttle are no setpoint"):
        setpoint_of(told, 0.0, readings(), SETTINGS)


def test_where_it_is_wanted_afterwards():
    """A move of 0.1 s forward; speeds leave the height alone wanted."""
    moved = FlightState.at_rest(torch.tensor([[0.3, 0.1, 1.9]], dtype=torch.float64))
    forward = goals_of(ActionSettings(), torch.tensor([0]))
    assert forward.reference_after(0.1, moved).tolist() == [[0.4, 0.0, 0.0, 2.0]]
    speeds = goals_of(ActionSettings(kind="velocity"), torch.zeros(1, 3))
    assert speeds.reference_after(0.1, moved).tolist() == [[0.3, 0.1, 0.0, 2.0]]
