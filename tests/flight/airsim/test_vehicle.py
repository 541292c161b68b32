"""Commands of a vehicle in AirSim's frames and units, and its permissions."""

import math

import pytest

from drone_rl.flight.airsim.messages import Pose
from drone_rl.flight.airsim.settings_file import Offset
from drone_rl.flight.commands.command import PilotError
from drone_rl.sim.dynamics.state import LOST
from drone_rl.utils.errors import InputError
from tests.flight.airsim.flying import FREE, KEEP, fly, make

HALF = math.sqrt(0.5)
SAME = (math.nan,) * 4


def test_takeoff_flight_and_landing():
    vehicle = make()
    assert vehicle.multirotor_state()["landed_state"] == 0
    assert fly(vehicle, vehicle.takeoff(20.0)) is True
    state = vehicle.multirotor_state()
    assert state["landed_state"] == 1
    assert state["kinematics_estimated"]["position"]["z_val"] == pytest.approx(-2.0, abs=0.15)
    future = vehicle.move_path([(4.0, 3.0, -3.0)], 3.0, 60.0, FREE, KEEP, -1.0, 1.0)
    assert fly(vehicle, future) is True
    assert vehicle.pose.position == pytest.approx((4.0, 3.0, -3.0), abs=0.6)
    assert fly(vehicle, vehicle.return_home(1e6)) is True
    assert vehicle.multirotor_state()["landed_state"] == 0
    assert math.hypot(*vehicle.pose.position[:2]) < 0.6


def test_movements_lift_off_from_the_ground():
    vehicle = make()
    assert fly(vehicle, vehicle.move_height(-1.5, 1.0, 20.0, KEEP, -1.0, 1.0)) is True
    assert vehicle.pose.position[2] < -1.0


def test_a_velocity_east_and_down_by_hand():
    vehicle = make()
    fly(vehicle, vehicle.takeoff(20.0))
    before = vehicle.pose.position
    assert fly(vehicle, vehicle.move_velocity((0.0, 2.0, -1.0), 2.0, FREE, KEEP)) is True
    after = vehicle.pose.position
    assert after[1] - before[1] > 2.0 and after[2] - before[2] < -1.0
    assert abs(after[0] - before[0]) < 0.2
    moving = vehicle.kinematics()
    assert moving["linear_velocity"]["y_val"] > 1.0


def test_body_frame_turns_with_the_heading():
    vehicle = make(start=Offset(0.0, 0.0, 0.0, yaw=90.0))
    fly(vehicle, vehicle.takeoff(20.0))
    fly(vehicle, vehicle.move_velocity((2.0, 0.0, 0.0), 2.0, FREE, KEEP, in_body=True))
    x, y, _ = vehicle.pose.position
    assert y > 2.0 and abs(x) < 0.3  # ahead of a drone that looks east


def test_pitch_up_flies_backward_and_yaw_is_clockwise():
    vehicle = make()
    fly(vehicle, vehicle.takeoff(20.0))
    fly(vehicle, vehicle.tilt(1.5, roll=0.0, pitch=math.radians(10.0), yaw=0.0, z=-2.0))
    assert vehicle.pose.position[0] < -0.3
    assert fly(vehicle, vehicle.turn_to(90.0, 20.0, 5.0)) is True
    w, _, _, z = vehicle.pose.attitude
    assert math.degrees(2 * math.atan2(z, w)) == pytest.approx(90.0, abs=6.0)


def test_without_api_control_nothing_moves():
    vehicle = make(has_api_control=False)
    assert vehicle.takeoff(20.0) is False
    assert vehicle.set_armed(True) is False
    vehicle.enable_api_control(True)
    assert vehicle.set_armed(True) is True
    assert fly(vehicle, vehicle.takeoff(20.0)) is True
    vehicle.reset()
    assert not vehicle.has_api_control
    assert vehicle.pose.position == (0.0, 0.0, 0.0)


def test_a_falling_vehicle_is_not_armed_and_says_so():
    vehicle = make()
    fly(vehicle, vehicle.takeoff(20.0))
    assert vehicle.set_armed(True) is True
    assert vehicle.set_armed(False) is True
    vehicle.run(vehicle.period)
    assert vehicle.set_armed(True) is False


def test_a_lost_vehicle_asks_for_a_reset():
    vehicle = make()
    vehicle.body.numbers[:, LOST] = 1.0
    with pytest.raises(PilotError, match="has diverged; call reset"):
        vehicle.takeoff(20.0)


def test_a_new_movement_cancels_the_old_one():
    vehicle = make()
    fly(vehicle, vehicle.takeoff(20.0))
    first = vehicle.move_path([(50.0, 0.0, -2.0)], 2.0, 60.0, FREE, KEEP, -1.0, 1.0)
    vehicle.run(vehicle.period)
    second = vehicle.hold()
    assert first.done and first.result() is False
    assert second.done  # a hover of no duration


def test_takeoff_in_motion_is_refused():
    vehicle = make()
    fly(vehicle, vehicle.takeoff(20.0))
    fly(vehicle, vehicle.move_velocity((3.0, 0.0, 0.0), 1.0, FREE, KEEP))
    with pytest.raises(PilotError, match="while moving"):
        vehicle.takeoff(20.0)
    with pytest.raises(InputError, match="lookahead=0 is too short"):
        vehicle.move_path([(1.0, 0.0, -2.0)], 1.0, 9.0, FREE, KEEP, 0.0, 1.0)


def test_computer_vision_has_no_dynamics():
    vehicle = make("ComputerVision", start=Offset(1.0, 0.0, 0.0))
    assert vehicle.body.position[0].tolist() == [1.0, 0.0, 2.5]
    with pytest.raises(PilotError, match="needs a vehicle with dynamics"):
        vehicle.takeoff(1.0)
    vehicle.enable_api_control(True)
    assert vehicle.has_api_control and vehicle.set_armed(True) is True
    vehicle.set_airsim_pose(Pose((2.0, 1.0, -3.0), (HALF, 0.0, 0.0, HALF)), ignore_collision=True)
    assert vehicle.pose.position == pytest.approx((2.0, 1.0, -3.0))
    assert vehicle.body.position[0].tolist() == pytest.approx([3.0, -1.0, 5.5])
    vehicle.set_airsim_pose(Pose((math.nan, 5.0, math.nan), SAME), ignore_collision=True)
    assert vehicle.pose.position == pytest.approx((2.0, 5.0, -3.0))
    assert vehicle.pose.attitude == pytest.approx((HALF, 0.0, 0.0, HALF))
