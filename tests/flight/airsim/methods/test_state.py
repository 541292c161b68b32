"""Poses, sensors and surroundings of a vehicle."""

from math import isnan

import pytest

from tests.flight.airsim.conftest import CV, YAW, pose


def test_the_legacy_pose_is_a_map_in_order(start):
    _, client = start(CV)
    found = client.call("simGetPose")
    assert [*found] == ["position", "orientation"]
    assert [*found["position"].values()] == [0.0, 0.0, 0.0]
    client.call("simSetPose", pose(1.0, 2.0, -3.0), True)
    assert [*client.call("simGetPose")["position"].values()] == [1.0, 2.0, -3.0]


@pytest.mark.parametrize("method", ["getCollisionInfo", "simGetCollisionInfo"])
@pytest.mark.parametrize("mode", ["Multirotor", "ComputerVision"])
def test_a_cube_that_is_touched_is_reported_once(start, mode, method):
    """The sweep to x = 30 m passes through cubes 0 and 1; a jump touches only where it ends."""
    z = -2.2 if mode == "Multirotor" else 0.0  # at the height of the cubes
    text = f'{{"SimMode": "{mode}", "Vehicles": {{"A": {{"Z": {z}}}}}}}'
    _, client = start(text, scene="cubes")

    def teleport(x, ignore_collision):
        client.call("simSetPose", pose(x, 0.0, 0.0), ignore_collision)

    for _ in range(2):
        client.call("reset")
        for i in range(3):
            client.call("simSetObjectPose", f"cube_{i}", pose(15.0 + 9.0 * i, 1.0, z), True)
        teleport(30.0, False)
        for i in range(2):
            found = client.call(method)
            assert (found["has_collided"], found["object_name"]) == (True, f"cube_{i}")
            assert found["object_id"] == client.call("simGetSegmentationObjectID", f"cube_{i}")
            assert found["position"]["x_val"] == pytest.approx(15.0 - 1.65 + 9.0 * i)
            assert found["impact_point"]["x_val"] == pytest.approx(15.0 - 1.25 + 9.0 * i)
            assert isnan(client.call("simGetObjectPose", f"cube_{i}")["position"]["x_val"])
        assert client.call(method)["has_collided"] is False
        teleport(40.0, True)
        assert client.call(method)["has_collided"] is False
        teleport(34.0, True)
        found = client.call(method)
        assert (found["has_collided"], found["object_name"]) == (True, "cube_2")
        assert client.call(method)["has_collided"] is False


def test_a_cube_that_a_flight_touches_is_reported_after_it(start):
    text = '{"Vehicles": {"A": {"Z": -2.5}}}'
    _, client = start(text, scene="cubes")
    client.call("enableApiControl", True)
    client.call("simSetObjectPose", "cube_0", pose(6.0, 0.0, -2.5), True)
    before = client.call("timestampNow")
    client.call("moveToPosition", 9.0, 0.0, 0.0, 4.0, 60.0, 0, YAW, -1.0, 1.0)
    assert client.call("getMultirotorState")["collision"]["object_name"] == "cube_0"
    found = client.call("getCollisionInfo")
    assert (found["has_collided"], found["object_name"]) == (True, "cube_0")
    assert 4.35 <= found["position"]["x_val"] <= 4.5
    assert before < found["time_stamp"] < client.call("timestampNow")
    assert client.call("getCollisionInfo")["has_collided"] is False


def test_line_of_sight_and_rotors(start):
    _, client = start()
    home = client.call("getHomeGeoPoint")
    above = {**home, "altitude": home["altitude"] + 10.0}
    assert client.call("simTestLineOfSightToPoint", above, "") is True
    assert client.call("simTestLineOfSightBetweenPoints", home, above) is True
    below = {**home, "altitude": home["altitude"] - 1.0}
    assert client.call("simTestLineOfSightBetweenPoints", below, above) is False
    _, blocks = start(CV, scene="blocks")  # of 4 m, 12 m apart; 0.0001 degrees are 11 m
    home = blocks.call("getHomeGeoPoint")
    behind = {**home, "latitude": home["latitude"] + 0.00015}
    assert blocks.call("simTestLineOfSightToPoint", behind, "") is False
    assert blocks.call("simTestLineOfSightToPoint", {**behind, "altitude": 222.0}, "") is True
    assert len(client.call("getRotorStates", "")["rotors"]) == 4
    assert client.call("getImuData", "", "")["orientation"]["w_val"] == pytest.approx(1.0)
    assert client.call("simGetGroundTruthEnvironment", "")["gravity"]["z_val"] == pytest.approx(
        9.8, abs=0.02
    )


def test_the_stratosphere_has_an_air_of_its_own(start):
    """216.65 K and 226 hPa from 11 km on, by the standard atmosphere."""
    _, client = start(CV)
    for height in (12e3, 9e5):
        client.call("simSetVehiclePose", pose(0.0, 0.0, -height), True)
        found = client.call("simGetGroundTruthEnvironment", "")
        assert found["temperature"] == pytest.approx(216.65)
        assert found["air_pressure"] == pytest.approx(22_632.0, rel=1e-3)


def test_kinematics_are_set_and_go_on(start):
    """At 3 m/s to the east the drone is some 0.3 m further after 0.1 s."""
    _, client = start()
    state = {
        **pose(1.0, 2.0, -30.0),
        "linear_velocity": {"x_val": 0.0, "y_val": 3.0, "z_val": 0.0},
        "angular_velocity": {"x_val": 0.0, "y_val": 0.0, "z_val": 0.25},
        "linear_acceleration": {},
        "angular_acceleration": {},
    }
    client.call("simSetKinematics", state, True, "")
    found = client.call("simGetGroundTruthKinematics", "")
    assert [*found["position"].values()] == pytest.approx([1.0, 2.0, -30.0])
    assert [*found["linear_velocity"].values()] == [0.0, 3.0, 0.0]
    assert [*found["angular_velocity"].values()] == [0.0, 0.0, 0.25]
    client.call("simContinueForTime", 0.1)
    after = client.call("simGetGroundTruthKinematics", "")["position"]
    assert after["y_val"] == pytest.approx(2.3, abs=0.05)
    with pytest.raises(RuntimeError, match=r"state\.linear_velocity"):
        client.call("simSetKinematics", pose(1.0, 2.0, -30.0), True, "")
    with pytest.raises(RuntimeError, match="Vehicle API for 'Who' is not available"):
        client.call("simSetKinematics", state, True, "Who")
