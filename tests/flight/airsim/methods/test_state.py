"""Poses, sensors and surroundings of a vehicle."""

import pytest

from tests.flight.airsim.conftest import CV, pose


def test_the_legacy_pose_is_a_map_in_order(start):
    _, client = start(CV)
    found = client.call("simGetPose")
    assert [*found] == ["position", "orientation"]
    assert [*found["position"].values()] == [0.0, 0.0, 0.0]
    client.call("simSetPose", pose(1.0, 2.0, -3.0), True)
    assert [*client.call("simGetPose")["position"].values()] == [1.0, 2.0, -3.0]


def test_line_of_sight_and_rotors(start):
    _, client = start()
    home = client.call("getHomeGeoPoint")
    above = {**home, "altitude": home["altitude"] + 10.0}
    assert client.call("simTestLineOfSightToPoint", above, "") is True
    assert len(client.call("getRotorStates", "")["rotors"]) == 4
    assert client.call("getImuData", "", "")["orientation"]["w_val"] == pytest.approx(1.0)
    assert client.call("simGetGroundTruthEnvironment", "")["gravity"]["z_val"] == pytest.approx(
        9.8, abs=0.02
    )
