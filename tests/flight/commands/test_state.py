import math

import pytest
import torch

from drone_rl.config.sensors import GpsSettings, SensorSettings
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.flight.commands.state import Collision, Trajectory
from drone_rl.sim.coordinates import HOME, Attitude, attitude_of
from drone_rl.sim.dynamics.state import DEPTH, GROUND, NORMAL, THING
from tests.perfect_sensors import without_noise

HALF = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("quaternion", "angles"),
    [
        ((1, 0, 0, 0), (0, 0, 0)),
        ((HALF, HALF, 0, 0), (90, 0, 0)),
        ((math.cos(0.25), 0, math.sin(0.25), 0), (0, -math.degrees(0.5), 0)),
        ((0.5, 0.5, -0.5, 0.5), (0, 90, -90)),  # nose up, turned to the left
        ((0, -HALF, 0, HALF), (0, -90, -180)),
        ((0.5, -0.5, 0.5, 0.5), (0, -90, -90)),
    ],
)
def test_angles(quaternion, angles):
    found = Attitude.of(quaternion)
    assert (found.roll, found.pitch, found.yaw) == pytest.approx(angles, abs=1e-6)


@pytest.mark.parametrize("pitch", [-90, 90])
@pytest.mark.parametrize(("roll", "yaw"), [(0, 30), (0, -120), (20, 50)])
def test_yaw_is_known_with_the_nose_straight_up_or_down(pitch, roll, yaw):
    """There yaw and roll turn about one axis, in opposite senses with the nose up."""
    turn = yaw - roll if pitch > 0 else yaw + roll
    found = Attitude.of(attitude_of(roll, pitch, yaw).tolist())
    assert (found.roll, found.pitch, found.yaw) == pytest.approx((0, pitch, turn), abs=1e-4)


def test_contacts_have_names(hovering):
    body = hovering((0, 0, 1))
    assert Collision.of(body) is None
    body.numbers[0, THING] = GROUND
    body.numbers[0, NORMAL : NORMAL + 3] = torch.tensor([0.0, 0.0, 1.0]).double()
    body.numbers[0, DEPTH] = 0.25
    touched = Collision.of(body)
    assert (touched.thing, touched.normal, touched.depth) == ("ground", (0, 0, 1), 0.25)
    body.numbers[0, THING] = 3
    assert Collision.of(body).thing == "obstacle 3"


PERFECT = without_noise(SensorSettings(gps=GpsSettings(latency=0.0)))


def test_of_a_flight_they_tell_height_and_place():
    pilot = Pilot(sensors=PERFECT)
    on_the_ground = pilot.sensors.barometer().altitude
    assert not pilot.sensors.gps().is_valid  # within its first second
    pilot.arm()
    pilot.take_off()
    pilot.move_to(4, 0, 2, speed=3)
    pilot.advance(1.5)
    x, _, z = pilot.state.position
    risen = pilot.sensors.barometer().altitude - on_the_ground
    assert risen == pytest.approx(z - 0.3, abs=0.1)
    place = pilot.sensors.gps()
    north = math.radians(float(place.place[0]) - HOME.latitude) * 6.37e6
    assert place.is_valid and north == pytest.approx(x, abs=0.3)
    assert pilot.sensors.time == pytest.approx(pilot.time)


def test_where_nobody_asked_they_are_turned_on_by_the_first_look():
    pilot, other = Pilot(), Pilot(sensors=SensorSettings())
    for each in (pilot, other):
        each.advance(1.0)
    assert pilot._sensors is None
    assert pilot.sensors.time == 0.0 and pilot.sensors is pilot.sensors
    assert pilot.sensors.settings == SensorSettings()
    assert (pilot.body.numbers == other.body.numbers).all()


def test_it_grows(hovering):
    way = Trajectory()
    assert (len(way), way.positions.shape) == (0, (0, 3))
    body = hovering((1, 2, 3))
    way.append(0.5, body)
    body.position[0, 0] = 9.0  # what is noted stays
    body.velocity[0, 1] = 4.0
    way.append(0.75, body)
    assert way.times.tolist() == [0.5, 0.75]
    assert way.positions.tolist() == [[1, 2, 3], [9, 2, 3]]
    assert way.velocities.tolist() == [[0, 0, 0], [0, 4, 0]]
    assert way.attitudes.tolist() == [[1, 0, 0, 0]] * 2
    assert way.rotors.shape == (2, 4)
