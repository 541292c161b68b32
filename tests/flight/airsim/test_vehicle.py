"""Frames, state and permissions of a vehicle: NED relative to its start, latches, sight."""

import math

import pytest

from drone_rl.flight.airsim.messages import Pose
from drone_rl.flight.commands.command import PilotError
from drone_rl.sim.coordinates import HOME
from drone_rl.sim.dynamics.state import LOST
from tests.flight.airsim.flying import BOX, fly, make

HALF = math.sqrt(0.5)
SAME = (math.nan,) * 4


def test_positions_are_relative_to_the_start():
    vehicle = make(x=3.0, y=4.0, z=0.0, yaw=90.0)
    x, y, z = vehicle.body.position[0].tolist()
    assert (x, y) == (3.0, -4.0)  # 4 m east is 4 m to the right
    assert z == pytest.approx(vehicle.settings.radius)
    assert vehicle.pose.position == (0.0, 0.0, 0.0)
    assert vehicle.pose.attitude == pytest.approx((HALF, 0.0, 0.0, HALF))  # clockwise from above
    place = vehicle.geo_point()
    assert place["latitude"] > HOME.latitude and place["longitude"] > HOME.longitude


def test_collisions_latch_until_they_are_read():
    vehicle = make(obstacles=BOX)
    fly(vehicle, vehicle.move_to_z(1.0))
    vehicle.collision()
    fly(vehicle, vehicle.move_by_velocity(3.0, 0.0, 0.0, 3.0))
    seen = vehicle.multirotor_state()["collision"]
    assert seen["has_collided"] and seen["object_name"] == "box"
    read = vehicle.collision()
    assert read["has_collided"] and read["object_id"] == -1  # there is no scene
    assert read["normal"]["x_val"] == pytest.approx(-1.0)
    assert read["impact_point"]["x_val"] == pytest.approx(4.0, abs=0.1)
    radius = vehicle.settings.radius
    assert read["position"]["x_val"] == pytest.approx(read["impact_point"]["x_val"] - radius)
    vehicle.set_airsim_pose(Pose((0.0, 0.0, -1.0), SAME), ignore_collision=True)
    vehicle.run(vehicle.period)
    later = vehicle.collision()
    assert not later["has_collided"]
    assert later["position"] == read["position"]  # at the contact, not now


def test_a_velocity_that_is_set_is_no_acceleration():
    vehicle = make()
    vehicle.run(vehicle.period)
    vehicle.set_kinematics(Pose((0.0, 0.0, -9.0), SAME), (3.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    found = vehicle.kinematics()
    assert [*found["linear_velocity"].values()] == [3.0, 0.0, 0.0]
    assert [*found["linear_acceleration"].values()] == [0.0, 0.0, 0.0]
    assert [*found["angular_acceleration"].values()] == [0.0, 0.0, 0.0]


def test_rotors_of_a_hovering_drone_carry_its_weight_and_the_past_is_not_kept():
    vehicle = make()
    fly(vehicle, vehicle.take_off())
    for _ in range(100):
        vehicle.run(vehicle.period)
    thrust = sum(rotor["thrust"] for rotor in vehicle.rotor_states()["rotors"])
    assert thrust == pytest.approx(9.80665 * vehicle.settings.mass, rel=0.02)
    assert len(vehicle.trajectory) == 1


def test_a_falling_or_lost_vehicle_says_so():
    vehicle = make()
    fly(vehicle, vehicle.take_off())
    assert vehicle.set_armed(False) is True
    vehicle.run(vehicle.period)
    assert vehicle.set_armed(True) is False
    vehicle.body.numbers[:, LOST] = 1.0
    with pytest.raises(PilotError, match="has diverged; call reset"):
        vehicle.take_off()


def test_computer_vision_has_no_dynamics():
    vehicle = make("ComputerVision", x=1.0)
    with pytest.raises(PilotError, match="needs a vehicle with dynamics"):
        vehicle.take_off()
    assert vehicle.set_armed(True) is True
    vehicle.set_airsim_pose(Pose((2.0, 1.0, -3.0), (HALF, 0.0, 0.0, HALF)), ignore_collision=True)
    assert vehicle.body.position[0].tolist() == pytest.approx([3.0, -1.0, 5.5])
    vehicle.set_airsim_pose(Pose((math.nan, 5.0, math.nan), SAME), ignore_collision=True)
    assert vehicle.pose.position == pytest.approx((2.0, 5.0, -3.0))
    assert vehicle.pose.attitude == pytest.approx((HALF, 0.0, 0.0, HALF))


def test_ground_is_no_new_collision_at_rest_and_forgotten_at_takeoff():
    vehicle = make()
    for _ in range(20):
        vehicle.run(vehicle.period)
    assert vehicle.collision()["object_name"] == "Ground"
    for _ in range(20):
        vehicle.run(vehicle.period)
        assert not vehicle.collision()["has_collided"]
        assert vehicle.collision(is_legacy=True)["has_collided"]
    vehicle.reset()
    vehicle.run(vehicle.period)
    fly(vehicle, vehicle.take_off())
    assert not vehicle.collision()["has_collided"]
    assert not vehicle.collision(is_legacy=True)["has_collided"]
    fly(vehicle, vehicle.land())
    assert vehicle.collision()["object_name"] == "Ground"


@pytest.mark.parametrize("kind", ["SimpleFlight", "ComputerVision"])
def test_a_vehicle_starts_at_the_z_of_the_settings_and_stays_there(kind):
    vehicle = make(kind, x=1.0, y=2.0, z=-4.0)
    usual, lower = (vehicle.settings.radius,) * 2 if kind == "SimpleFlight" else (2.5, 1.5)
    assert vehicle.body.position[0].tolist() == pytest.approx([1.0, -2.0, usual + 4.0])
    for _ in range(2):
        for _ in range(50):
            vehicle.run(vehicle.period)
        assert vehicle.pose.position == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
        vehicle.reset()
    heights = [make(kind, z=z).body.position[0, 2] for z in (0.0, 1.0, 9.0)]
    assert heights == [usual, lower, vehicle.settings.radius]


def test_an_armed_vehicle_that_is_put_into_the_air_hovers():
    for state, height in (("Armed", -3.0), ("Disarmed", 0.0)):
        vehicle = make(default_vehicle_state=state)
        vehicle.set_airsim_pose(Pose((5.0, 0.0, -3.0), SAME), ignore_collision=True)
        for _ in range(100):
            vehicle.run(vehicle.period)
        assert vehicle.pose.position[2] == pytest.approx(height, abs=0.2)


def test_teleports_that_an_obstacle_stops_are_collisions():
    vehicle = make(obstacles=BOX)
    for is_legacy in (True, False):
        vehicle.set_airsim_pose(Pose((0.0, 0.0, -0.7), SAME), ignore_collision=True)
        assert not vehicle.collision(is_legacy=is_legacy)["has_collided"]
        vehicle.set_airsim_pose(Pose((9.0, 0.0, -0.7), SAME), ignore_collision=False)
        found = vehicle.collision(is_legacy=is_legacy)
        assert (found["has_collided"], found["object_name"]) == (True, "box")
        assert [*found["normal"].values()] == pytest.approx([-1.0, 0.0, 0.0])
        assert found["impact_point"]["x_val"] == pytest.approx(4.0)
        assert found["position"] == vehicle.kinematics()["position"]
        assert not vehicle.collision(is_legacy=is_legacy)["has_collided"]
    vehicle.set_airsim_pose(Pose((0.0, 0.0, 1.0), SAME), ignore_collision=False)
    for is_new in (True, False):
        assert vehicle.collision()["has_collided"] is is_new
        assert vehicle.collision()["object_name"] == "Ground"
        for _ in range(20):
            vehicle.run(vehicle.period)


@pytest.mark.parametrize("ignore_collision", [True, False])
def test_a_vehicle_that_is_moved_along_the_ground_does_not_collide_anew(ignore_collision):
    vehicle = make()
    for x in range(10):
        vehicle.set_airsim_pose(Pose((x, 0.0, 0.0), SAME), ignore_collision=ignore_collision)
        for _ in range(5):
            vehicle.run(vehicle.period)
        assert vehicle.collision()["has_collided"] is (x == 0)
