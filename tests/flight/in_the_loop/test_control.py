import dataclasses
import math

import numpy as np
import pytest
import torch

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.flight.in_the_loop.control import (
    AT_REST,
    RcSticks,
    Setpoint,
    setpoint_of,
    sticks_for,
    velocity_to,
)
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode, Quadrotor
from drone_rl.utils.errors import InputError

SETTINGS = DynamicsSettings(mode="simple_flight")
HALF = math.sqrt(0.5)


def readings(velocity=(0.0, 0.0, 0.0), attitude=(1.0, 0.0, 0.0, 0.0)):
    zeros = np.zeros(3)
    return Readings(0.0, zeros, np.array(velocity), np.array(attitude), zeros, zeros)


def hands(setpoint, now, integral=0.0, seconds=0.01):
    return sticks_for(setpoint, now, integral, seconds, SETTINGS)


def test_channels():
    sticks = RcSticks(roll=0.5, pitch=-1.0, throttle=0.25, yaw=0.1, armed=True)
    assert sticks.channels == [1750, 1000, 1250, 1450, 2000, 2000]
    assert AT_REST.channels == [1500, 1500, 1000, 1500, 1000, 2000]
    assert RcSticks(roll=9.0, throttle=9.0).channels[:3] == [2000, 1500, 2000]


def test_forward_is_nose_down():
    """1 m/s is missing: a fifth of pi / 5.5, of 60 degrees at full stick."""
    sticks, _ = hands(Setpoint((1.0, 0.0, 0.0)), readings())
    assert sticks.pitch == pytest.approx(0.2 * (math.pi / 5.5) / math.radians(60.0))
    assert (sticks.roll, sticks.yaw, sticks.throttle) == (0.0, 0.0, 0.5)


def test_to_the_left_is_a_roll_to_the_left():
    sticks, _ = hands(Setpoint((0.0, 99.0, 0.0)), readings())
    assert sticks.roll == pytest.approx(-(180 / 5.5) / 60)  # no more than the limit


def test_sticks_are_those_of_who_looks_west():
    """West is ahead of him, so the nose goes down; the heading that he has is the one wished."""
    west = readings(attitude=(HALF, 0.0, 0.0, HALF))
    sticks, _ = hands(Setpoint((0.0, 1.0, 0.0), math.pi / 2), west)
    assert sticks.pitch > 0.1
    assert sticks.roll == pytest.approx(0.0, abs=1e-12)
    assert sticks.yaw == pytest.approx(0.0, abs=1e-12)


def test_headings_take_the_short_way():
    to_left, _ = hands(Setpoint((0.0, 0.0, 0.0), 0.1), readings())
    assert to_left.yaw == pytest.approx(0.15 / math.radians(200))
    over_pi, _ = hands(Setpoint((0.0, 0.0, 0.0), 2 * math.pi - 0.1), readings())
    assert over_pi.yaw == pytest.approx(-0.15 / math.radians(200))


def test_turning_wherever_that_leads():
    """Half of 200 degrees a second, be the heading what it may."""
    sticks, _ = hands(
        Setpoint((0.0, 0.0, 0.0), heading=2.0, yaw_rate=math.radians(100)), readings()
    )
    assert sticks.yaw == pytest.approx(0.5)
    faster, _ = hands(Setpoint((0.0, 0.0, 0.0), yaw_rate=-9.0), readings())
    assert faster.yaw == -1.0


def test_the_climb_remembers():
    sticks, climb = hands(Setpoint((0.0, 0.0, 0.2)), readings(), 0.1, seconds=0.5)
    assert climb == pytest.approx(0.1 + 2.0 * 0.2 * 0.5)
    assert sticks.throttle == pytest.approx(0.5 + 0.5 * (0.4 + 0.3))


def test_the_way_to_a_place_is_straight_and_within_limits():
    """A quarter of 6 m/s for each metre, 6 m/s at most along the line; up at 4 m/s at most."""
    assert velocity_to(np.array([1.0, 0.0, -0.4]), readings(), SETTINGS) == (1.5, 0.0, -0.4)
    fast = velocity_to(np.array([30.0, 40.0, 99.0]), readings(), SETTINGS)
    assert fast == pytest.approx((3.6, 4.8, 4.0))


def at(position=(0.0, 0.0, 2.0), heading=0.0):
    attitude = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
    return dataclasses.replace(readings(attitude=attitude), position=np.array(position))


def body():
    return FlightState.at_rest(torch.tensor([[0.0, 0.0, 2.0]], dtype=torch.float64))


def goals_of(actions, action):
    return Quadrotor(SETTINGS, actions).steering.goals(body(), action)


def test_a_move_is_a_place_that_drifts():
    """At 4 m/s; after 0.05 s it is 0.2 m ahead: 0.25 * 6 * 0.2 = 0.3 m/s more."""
    left = goals_of(ActionSettings(), torch.tensor([1]))
    first = setpoint_of(left, 0.0, at(), SETTINGS)
    assert (*first.velocity, first.heading, first.yaw_rate) == (0.0, 4.0, 0.0, 0.0, None)
    later = setpoint_of(left, 0.05, at(), SETTINGS)
    assert later.velocity == pytest.approx((0.0, 4.3, 0.0))
    far = setpoint_of(left, 0.0, at((0.0, -9.0, 1.9)), SETTINGS)
    assert far.velocity == pytest.approx((0.0, 6.0, 0.1))  # its limit; 0.25 * 4 * 0.1 upwards


def test_speeds_go_with_the_heading():
    """Full speed forward and half to the left, of who looks to the left; half the rate of 45."""
    told = goals_of(ActionSettings(kind="velocity"), torch.tensor([[1.0, 0.5, -0.5]]))
    setpoint = setpoint_of(told, 0.05, at(heading=math.pi / 2), SETTINGS)
    assert setpoint.velocity == pytest.approx((-1.5, 4.0, 0.0))
    assert setpoint.yaw_rate == pytest.approx(-math.radians(22.5))


def test_velocities_of_the_world():
    modes = (Mode.VELOCITY, Mode.VELOCITY, Mode.ANGLE, Mode.VELOCITY)
    told = FlightGoals(modes, torch.tensor([[1.0, 2.0, 0.3, 9.0]], dtype=torch.float64))
    setpoint = setpoint_of(told, 1.0, at(heading=1.0), SETTINGS)
    assert (*setpoint.velocity, setpoint.heading) == pytest.approx((1.0, 2.0, 4.0, 0.3))


def test_angles_are_no_setpoint():
    modes = (Mode.ANGLE, Mode.ANGLE, Mode.RATE, Mode.THROTTLE)
    told = FlightGoals(modes, torch.zeros(1, 4, dtype=torch.float64))
    with pytest.raises(InputError, match="angle, angle, rate, throttle are no setpoint"):
        setpoint_of(told, 0.0, at(), SETTINGS)


def test_where_it_is_wanted_afterwards():
    """A move of 0.1 s forward; speeds leave the height alone wanted."""
    moved = FlightState.at_rest(torch.tensor([[0.3, 0.1, 1.9]], dtype=torch.float64))
    forward = goals_of(ActionSettings(), torch.tensor([0]))
    assert forward.reference_after(0.1, moved).tolist() == [[0.4, 0.0, 0.0, 2.0]]
    speeds = goals_of(ActionSettings(kind="velocity"), torch.zeros(1, 3))
    assert speeds.reference_after(0.1, moved).tolist() == [[0.3, 0.1, 0.0, 2.0]]
