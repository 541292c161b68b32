import math

import numpy as np
import pytest
import torch

from drone_rl.flight.in_the_loop.instruments import Readings, measure
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.sim.dynamics import BodyState

HALF = math.sqrt(0.5)
LEFT = np.array([HALF, 0.0, 0.0, HALF])  # a quarter turn to the left
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def state(velocity=(0.0, 0.0, 0.0), attitude=(1.0, 0.0, 0.0, 0.0)):
    body = BodyState.at_rest(torch.zeros(1, 3, dtype=torch.float64))
    body.velocity = torch.tensor([velocity], dtype=torch.float64)
    body.attitude = torch.tensor([attitude], dtype=torch.float64)
    return body


def test_at_rest_an_accelerometer_feels_the_floor():
    readings = measure(state(), state(), 0.001, 2.0)
    assert readings.force.tolist() == [0.0, 0.0, 9.81]
    assert readings.rates.tolist() == [0.0, 0.0, 0.0]
    assert (readings.time, readings.heading) == (2.0, 0.0)


def test_in_free_fall_it_feels_nothing():
    falling = state(velocity=(0.0, 0.0, -0.0981))
    assert measure(state(), falling, 0.01, 0.0).force == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_forces_are_those_of_the_body():
    """It looks west and is pushed west: forward."""
    before, after = state(attitude=tuple(LEFT)), state((0.0, 0.02, 0.0), tuple(LEFT))
    readings = measure(before, after, 0.01, 0.0)
    assert readings.force == pytest.approx([2.0, 0.0, 9.81])
    assert readings.heading == pytest.approx(math.pi / 2)


def turned(before, after):
    return measure(state(attitude=tuple(before)), state(attitude=tuple(after)), 1.0, 0.0).rates


def test_turns_know_no_sign_of_quaternions():
    for end in (LEFT, -LEFT):
        assert turned(LEVEL, end) == pytest.approx([0.0, 0.0, math.pi / 2])
    assert turned(LEFT, LEVEL) == pytest.approx([0.0, 0.0, -math.pi / 2])
    assert turned(LEFT, LEFT).tolist() == [0.0, 0.0, 0.0]


def test_turns_are_about_the_bodys_axes():
    """Looking west, it rolls by a quarter: about its own x."""
    rolled = np.array([0.5, 0.5, 0.5, 0.5])
    assert turned(LEFT, rolled) == pytest.approx([math.pi / 2, 0.0, 0.0])


def test_place_and_altitude_are_counted_from_home():
    zeros, home = np.zeros(3), GeoPoint(50.0, 8.0, 100.0)
    readings = Readings(0.0, np.array([0.0, 0.0, 5.0]), zeros, LEVEL, zeros, zeros, home)
    assert readings.place.tolist() == [50.0, 8.0, 105.0]
    assert readings.altitude == 105.0
    assert readings.pressure == pytest.approx(100_070.0, abs=0.5)
