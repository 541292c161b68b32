"""Signs of Fig. 4 and AirSim at the pilot's boundary, against numbers computed by hand."""

import math

import pytest

import drone_rl
from drone_rl.sim.entities import find_camera


@pytest.mark.parametrize("yaw", [0.0, 30.0, -90.0, 170.0])
def test_initial_heading(yaw):
    pilot = drone_rl.Pilot(yaw=yaw)
    assert pilot.state.attitude.yaw == pytest.approx(yaw)
    assert float(pilot.body.heading) == pytest.approx(-math.radians(yaw))


@pytest.mark.parametrize(
    ("angles", "axis", "sign"),
    [
        ({"roll": 5.0, "pitch": 0.0}, 1, -1),  # the right side down: to the right
        ({"roll": -5.0, "pitch": 0.0}, 1, 1),
        ({"roll": 0.0, "pitch": 5.0}, 0, -1),  # the nose up: backward
        ({"roll": 0.0, "pitch": -5.0}, 0, 1),
    ],
)
def test_tilt_accelerates(flying, angles, axis, sign):
    flying.move_by_angle(**angles, duration=1.0)
    assert sign * flying.state.velocity[axis] > 0.2
    assert abs(flying.state.velocity[1 - axis]) < 0.1


@pytest.mark.parametrize(
    "turn",
    [
        lambda pilot, yaw: pilot.rotate_to(yaw),
        lambda pilot, yaw: pilot.rotate_by(yaw / 2, 2.0),
        lambda pilot, yaw: pilot.move_by_angle(0.0, 0.0, 2.0, yaw=yaw),
        lambda pilot, yaw: pilot.move_by_velocity(
            0.0, 0.0, duration=2.0, yaw_mode=drone_rl.YawMode(False, yaw)
        ),
        lambda pilot, yaw: pilot.move_by_velocity(
            0.0, 0.0, duration=2.0, yaw_mode=drone_rl.YawMode(True, yaw / 2)
        ),
        lambda pilot, yaw: pilot.move_by_angle(0.0, 0.0, 2.0, yaw_rate=yaw / 2),
    ],
)
@pytest.mark.parametrize("yaw", [30.0, -30.0])
def test_positive_yaw_turns_right(flying, turn, yaw):
    turn(flying, yaw)
    assert flying.state.attitude.yaw == pytest.approx(yaw, abs=8.0)
    assert float(flying.body.heading) * yaw < 0


@pytest.mark.parametrize(
    ("number", "name", "place"),
    [
        (0, "front_center", (0.4, 0.0, 0.0)),
        (1, "front_right", (0.4, -0.25, 0.0)),
        (2, "front_left", (0.4, 0.25, 0.0)),
        (3, "bottom_center", (0.0, 0.0, -0.1)),
        (4, "back_center", (-0.4, 0.0, 0.0)),
    ],
)
def test_camera_numbers_are_those_of_airsim(number, name, place):
    """As in `FlyingPawn.cpp` from version 1.1.3 on; y is to the left."""
    for given in (number, str(number), name):
        assert find_camera(given).name == name
    assert find_camera(number).pos == pytest.approx(place)
    assert drone_rl.ImageRequest(number, 0, False, False).camera == name
