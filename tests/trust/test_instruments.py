"""What is read off a drone in flight, and how it is shown."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.coordinates import Attitude
from drone_rl.sim.dynamics import FlightState
from drone_rl.trust import instruments
from drone_rl.trust.instruments import HEIGHT, WIDTH, Reading, horizon, panel, read

LEVEL = Attitude(0.0, 0.0, 0.0)


def ground(attitude):
    """Where the dial shows the ground. Shape: (136, 136)."""
    return np.asarray(horizon(attitude)).astype(int)[..., 2] < 100


def test_speeds_are_in_the_drone_frame():
    body = FlightState.at_rest(torch.tensor([[0.0, 0.0, 2.5]], dtype=torch.float64))
    half = math.radians(90.0) / 2  # looks to the world's left
    body.attitude[:] = torch.tensor([math.cos(half), 0.0, 0.0, math.sin(half)])
    body.velocity[:] = torch.tensor([1.0, 2.0, -0.5])
    body.rotors[:] = torch.tensor([0.1, 0.2, 0.3, 0.4])
    found = read(body)
    assert found.speeds == pytest.approx((2.0, -1.0, -0.5))  # 1 m/s along x is to its right
    assert found.attitude.yaw == pytest.approx(-90.0)
    assert found.rotors == pytest.approx((0.1, 0.2, 0.3, 0.4))


def test_horizon_of_a_level_drone():
    shown = ground(LEVEL)
    assert shown[90, 68] and not shown[46, 68]
    assert shown[80, 20:116].all() and not shown[56, 20:116].any()


def test_horizon_with_the_nose_down():
    assert ground(Attitude(0.0, -20.0, 0.0))[40, 60]  # 20 of 40 degrees: half the radius up, 34
    assert not ground(Attitude(0.0, -20.0, 0.0))[28, 60]
    assert not ground(Attitude(0.0, 20.0, 0.0))[96, 60]


def test_horizon_with_the_right_side_down():
    shown = ground(Attitude(30.0, 0.0, 0.0))
    # 40 pixels to the right it stands 40 tan 30 = 23 above the middle
    assert shown[68 - 19, 108] and not shown[68 - 28, 108]
    assert shown[68 + 28, 28] and not shown[68 + 19, 28]


def bar_pixels(image, left, top, right, bottom):
    return int((np.asarray(image)[top:bottom, left:right] == instruments._BAR).all(-1).sum())


def test_motor_bars_are_as_long_as_their_thrust():
    image = panel(Reading(LEVEL, (0.0, 0.0, 0.0), (1.0, 0.0, 0.5, 0.0)), 0.5)
    assert image.size == (WIDTH, HEIGHT)
    front_left, front_right = (bar_pixels(image, x, 30, x + 36, 90) for x in (341, 413))
    rear = bar_pixels(image, 330, 106, WIDTH, 170)
    assert front_right > 1.8 * front_left > 0
    assert rear < 0.05 * front_right  # a line, at nothing
