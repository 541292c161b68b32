import numpy as np
import pytest

from drone_rl.flight.firmware.course import (
    Course,
    HoldPilot,
    PathPilot,
    distance_from,
    fly_course,
    land,
    square,
    take_off,
)
from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.flight import LoopedDrone
from drone_rl.flight.firmware.senses import Senses
from drone_rl.flight.firmware.sitl import Betaflight
from tests.flight.firmware.simple_body import SETTINGS, SimpleBody

ORIGIN = np.zeros(3)


def senses(time=0.0, position=(0.0, 0.0, 0.0)):
    level = np.array([1.0, 0.0, 0.0, 0.0])
    return Senses(time, np.array(position), ORIGIN, level, ORIGIN, ORIGIN)


def test_a_square_goes_forward_left_back_right():
    corners = [corner.tolist() for corner in square(np.array([1.0, 0.0, 3.0]), 2.0)]
    assert corners == [[1, 0, 3], [3, 0, 3], [3, 2, 3], [1, 2, 3], [1, 0, 3]]


@pytest.mark.parametrize(
    ("place", "distance"),
    [
        ((1.0, 0.0, 0.0), 0.0),
        ((1.0, -0.5, 0.0), 0.5),
        ((1.0, 1.0, 2.0), 5**0.5),
        ((5, 6, 0), 5),
    ],
)
def test_distance_from_a_path(place, distance):
    assert distance_from(square(ORIGIN, 2.0), np.array(place)) == pytest.approx(distance)


def test_a_path_moves_on_with_time():
    pilot = PathPilot(square(ORIGIN, 10.0), 2.0, SETTINGS)
    assert pilot.seconds == 20.0
    assert pilot(None, senses(5.0)).velocity == (2.0, 0.0, 0.0)
    # A second later the point is 2 m ahead: 1.5 m/s for each metre beside its own speed.
    assert pilot(None, senses(6.0)).velocity == pytest.approx((5.0, 0.0, 0.0))
    assert pilot(None, senses(11.0, (10.0, 2.0, 0.0))).velocity == pytest.approx((0.0, 2.0, 0.0))
    assert pilot(None, senses(99.0)).velocity == (0.0, 0.0, 0.0)


def test_holding_a_place():
    pilot = HoldPilot(np.array([0.0, 1.0, 0.0]), SETTINGS, heading=0.5)
    wish = pilot(None, senses())
    assert (wish.velocity, wish.heading) == ((0.0, 1.5, 0.0), 0.5)


@pytest.mark.slow
def test_a_whole_flight_through_the_stub(stub, tmp_path):
    body = SimpleBody()
    with Betaflight(stub(), tmp_path) as firmware:
        drone = LoopedDrone(body, body.start(), firmware, SETTINGS)
        report = fly_course(drone, Course(height=0.6, side=0.5, speed=0.5, hover=3.2))
    assert report.hover_error_m < 0.1
    assert report.path_error_m < 0.3
    assert report.path_error_m < report.path_error_max_m < 1.0
    assert report.landing_error_m < 0.3
    assert report.simulated_s == pytest.approx(drone.time)
    assert set(report.values()) >= {"hover_error_m", "path_error_m", "wall_s"}
    assert drone.senses.position[2] == 0.0


class Dead:
    """Rotors that never turn."""

    def step(self, senses, sticks):
        return np.zeros(4)


class Full:
    """Rotors that never stop."""

    def step(self, senses, sticks):
        return np.full(4, 0.7)


def test_a_drone_that_stays_on_the_ground():
    body = SimpleBody()
    drone = LoopedDrone(body, body.start(), Dead(), SETTINGS)
    with pytest.raises(LoopError, match=r"take-off: at 0.00 m, not 2.00 m, after 0.1 s"):
        take_off(drone, np.array([0.0, 0.0, 2.0]), within=0.1)


def test_a_drone_that_does_not_come_down():
    body = SimpleBody()
    drone = LoopedDrone(body, body.start(), Full(), SETTINGS)
    drone.fly(HoldPilot(ORIGIN, SETTINGS), 1.0)
    with pytest.raises(LoopError, match="landing: still"):
        land(drone, ORIGIN, within=0.1)


def test_a_take_off_ends_near_its_height_and_not_before():
    body = SimpleBody()
    drone = LoopedDrone(body, body.start(), Full(), SETTINGS)
    take_off(drone, np.array([0.0, 0.0, 2.0]))
    assert 1.7 < drone.senses.position[2] < 1.75


def test_corners_are_nearest_to_places_beyond_them():
    assert distance_from(square(ORIGIN, 2.0), np.array([-1.0, -1.0, 0.0])) == pytest.approx(2**0.5)
