import numpy as np
import pytest

from drone_rl.flight.betaflight.sitl import Betaflight
from drone_rl.flight.commands.path_following import Path
from drone_rl.flight.in_the_loop import trial_flight
from drone_rl.flight.in_the_loop.drone import DroneInTheLoop, FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.flight.in_the_loop.trial_flight import (
    Course,
    fly_course,
    follow_path,
    hold_position,
    land,
    square,
    take_off,
)
from tests.flight.arming import arm_at_once
from tests.flight.simple_body import SETTINGS, SimpleBody

ORIGIN = np.zeros(3)


def readings(time=0.0, position=(0.0, 0.0, 0.0)):
    level = np.array([1.0, 0.0, 0.0, 0.0])
    return Readings(time, np.array(position), ORIGIN, level, ORIGIN, ORIGIN)


def test_a_square_goes_forward_left_back_right():
    corners = [corner.tolist() for corner in square(np.array([1.0, 0.0, 3.0]), 2.0)]
    assert corners == [[1, 0, 3], [3, 0, 3], [3, 2, 3], [1, 2, 3], [1, 0, 3]]


def test_a_path_moves_on_with_time():
    pilot = follow_path(Path(square(ORIGIN, 10.0)), 2.0, SETTINGS)
    assert pilot(None, readings(5.0)).velocity == (2.0, 0.0, 0.0)
    # A second later the point is 2 m ahead: 1.5 m/s for each metre beside its own speed.
    assert pilot(None, readings(6.0)).velocity == pytest.approx((5.0, 0.0, 0.0))
    assert pilot(None, readings(11.0, (10.0, 2.0, 0.0))).velocity == pytest.approx((0.0, 2.0, 0.0))
    assert pilot(None, readings(99.0)).velocity == (0.0, 0.0, 0.0)


def test_holding_a_place():
    pilot = hold_position(np.array([0.0, 1.0, 0.0]), SETTINGS)
    setpoint = pilot(None, readings())
    assert (setpoint.velocity, setpoint.heading) == ((0.0, 1.5, 0.0), 0.0)


@pytest.mark.slow
def test_a_whole_flight_through_the_stub(stub, tmp_path, monkeypatch):
    arm_at_once(monkeypatch)
    monkeypatch.setattr(trial_flight, "_SETTLING", 2.0)
    body = SimpleBody()
    with Betaflight(stub(), tmp_path) as firmware:
        drone = DroneInTheLoop(body, body.start(), firmware, SETTINGS)
        report = fly_course(drone, Course(height=0.6, side=0.5, speed=0.5, hover=2.2))
    assert report.hover_error_m < 0.1
    assert report.path_error_m < 0.3
    assert report.path_error_m < report.path_error_max_m < 1.0
    assert report.landing_error_m < 0.3
    assert report.simulated_s == pytest.approx(drone.time)
    assert drone.readings.position[2] == 0.0
    assert np.ptp([readings.position for readings in drone.trace], axis=0)[:2].min() > 0.3


class Dead:
    """Rotors that never turn."""

    def step(self, readings, sticks):
        return np.zeros(4)


class Full:
    """Rotors that never stop."""

    def step(self, readings, sticks):
        return np.full(4, 0.7)


def test_a_drone_that_stays_on_the_ground():
    body = SimpleBody()
    drone = DroneInTheLoop(body, body.start(), Dead(), SETTINGS)
    with pytest.raises(
        FlightControllerError, match=r"take-off: at 0.00 m, not 2.00 m, after 0.1 s"
    ):
        take_off(drone, np.array([0.0, 0.0, 2.0]), within=0.1)


def test_a_drone_that_does_not_come_down():
    body = SimpleBody()
    drone = DroneInTheLoop(body, body.start(), Full(), SETTINGS)
    drone.fly(hold_position(ORIGIN, SETTINGS), 1.0)
    with pytest.raises(FlightControllerError, match="landing: still"):
        land(drone, ORIGIN, within=0.1)


def test_a_take_off_ends_near_its_height_and_not_before():
    body = SimpleBody()
    drone = DroneInTheLoop(body, body.start(), Full(), SETTINGS)
    take_off(drone, np.array([0.0, 0.0, 2.0]))
    assert 1.7 < drone.readings.position[2] < 1.75
