"""Wishes out of goals, by hand: AirSim's gains are 0.25 of 6 m/s for each metre, 4 m/s upwards."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.flight.firmware.senses import Senses
from drone_rl.flight.firmware.steered import told_after, wish_of
from drone_rl.sim.dynamics import FlightState, Goals, Mode, Quadrotor
from drone_rl.utils.errors import InputError

SETTINGS = DynamicsSettings(mode="simple_flight")


def senses(position=(0.0, 0.0, 2.0), heading=0.0):
    zeros = np.zeros(3)
    attitude = np.array([math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)])
    return Senses(0.0, np.array(position), zeros, attitude, zeros, zeros)


def body():
    return FlightState.at_rest(torch.tensor([[0.0, 0.0, 2.0]], dtype=torch.float64))


def goals_of(actions, action):
    return Quadrotor(SETTINGS, actions).steering.goals(body(), action)


def test_a_move_is_a_place_that_drifts():
    """At 4 m/s; after 0.05 s it is 0.2 m ahead: 0.25 * 6 * 0.2 = 0.3 m/s more."""
    left = goals_of(ActionSettings(), torch.tensor([1]))
    first = wish_of(left, 0.0, senses(), SETTINGS)
    assert (*first.velocity, first.heading, first.yaw_rate) == (0.0, 4.0, 0.0, 0.0, None)
    later = wish_of(left, 0.05, senses(), SETTINGS)
    assert later.velocity == pytest.approx((0.0, 4.3, 0.0))
    far = wish_of(left, 0.0, senses((0.0, -9.0, 1.9)), SETTINGS)
    assert far.velocity == pytest.approx((0.0, 6.0, 0.1))  # its limit; 0.25 * 4 * 0.1 upwards


def test_speeds_go_with_the_heading():
    """Full speed forward and half to the left, of who looks to the left; half the rate of 45."""
    told = goals_of(ActionSettings(kind="velocity"), torch.tensor([[1.0, 0.5, -0.5]]))
    wish = wish_of(told, 0.05, senses(heading=math.pi / 2), SETTINGS)
    assert wish.velocity == pytest.approx((-1.5, 4.0, 0.0))
    assert wish.yaw_rate == pytest.approx(-math.radians(22.5))


def test_velocities_of_the_world():
    modes = (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.VELOCITY)
    told = Goals(modes, torch.tensor([[1.0, 2.0, 0.3, 9.0]], dtype=torch.float64))
    wish = wish_of(told, 1.0, senses(heading=1.0), SETTINGS)
    assert (*wish.velocity, wish.heading) == pytest.approx((1.0, 2.0, 4.0, 0.3))


def test_no_wish_says_an_angle():
    modes = (Mode.ANGLE, Mode.ANGLE, Mode.RATE, Mode.THROTTLE)
    told = Goals(modes, torch.zeros(1, 4, dtype=torch.float64))
    with pytest.raises(InputError, match="angle, angle, rate, throttle are no wish"):
        wish_of(told, 0.0, senses(), SETTINGS)


def test_where_it_is_wanted_afterwards():
    """A move of 0.1 s forward; speeds leave the height alone wanted."""
    moved = FlightState.at_rest(torch.tensor([[0.3, 0.1, 1.9]], dtype=torch.float64))
    forward = goals_of(ActionSettings(), torch.tensor([0]))
    assert told_after(forward, 0.1, moved).tolist() == [[0.4, 0.0, 0.0, 2.0]]
    speeds = goals_of(ActionSettings(kind="velocity"), torch.zeros(1, 3))
    assert told_after(speeds, 0.1, moved).tolist() == [[0.3, 0.1, 0.0, 2.0]]
