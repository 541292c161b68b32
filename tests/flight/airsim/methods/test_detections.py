"""Detections by hand: boxes in the image, distances, names and radius."""

import math

import pytest

from tests.flight.airsim.conftest import SMALL, pose

ONE = {"x_val": 1.0, "y_val": 1.0, "z_val": 1.0}


@pytest.fixture
def client(start):
    """A client that has put a cube of 2 m, 10 m ahead of the front camera, at its height."""
    _, found = start(SMALL)
    height = found.call("simGetCameraInfo", "0", "")["pose"]["position"]["z_val"]
    two = {"x_val": 2.0, "y_val": 2.0, "z_val": 2.0}
    found.call("simSpawnObject", "box", "Cube", pose(10.4, 0.0, height), two)
    return found


def test_a_box_ahead_by_hand(client):
    """Its front is 9 m away and 2 m wide: 16 / 2 / 9 = 0.9 pixels to each side of the middle."""
    assert client.call("simGetDetections", "0", 0, "") == []
    client.call("simAddDetectionFilterMeshName", "0", 0, "bo*", "")
    (found,) = client.call("simGetDetections", "0", 0, "")
    assert found["name"] == "box"
    box = found["box2D"]
    assert (box["min"]["x_val"], box["max"]["x_val"]) == (7.0, 8.0)
    assert (box["min"]["y_val"], box["max"]["y_val"]) == (3.0, 4.0)
    there = found["relative_pose"]["position"]
    assert [*there.values()] == pytest.approx([10.0, 0.0, 0.0], abs=1e-6)
    turn = found["relative_pose"]["orientation"]
    assert [turn[f"{axis}_val"] for axis in "wxyz"] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    assert found["box3D"]["max"]["x_val"] == pytest.approx(10.0 + 3**0.5, abs=1e-3)
    home = client.call("getHomeGeoPoint")
    assert found["geo_point"]["latitude"] == pytest.approx(
        home["latitude"] + 10.4 / 111_190, abs=1e-7
    )


def test_a_box_to_the_right_is_right_of_the_middle(client):
    client.call("simAddDetectionFilterMeshName", "0", 0, "box", "")
    client.call("simSetObjectPose", "box", pose(10.4, 5.0, float("nan")), True)
    (found,) = client.call("simGetDetections", "0", 0, "")
    assert found["box2D"]["min"]["x_val"] > 9.0
    assert found["relative_pose"]["position"]["y_val"] == pytest.approx(5.0)


def test_boxes_out_of_sight_radius_or_names_are_not_detected(client):
    client.call("simAddDetectionFilterMeshName", "0", 0, "box", "")
    client.call("simAddDetectionFilterMeshName", "4", 0, "box", "")
    assert client.call("simGetDetections", "4", 0, "") == []  # it looks back
    client.call("simSetDetectionFilterRadius", "0", 0, 900, "")
    assert client.call("simGetDetections", "0", 0, "") == []
    client.call("simSetDetectionFilterRadius", "0", 0, 1100, "")
    assert len(client.call("simGetDetections", "0", 0, "")) == 1
    client.call("simClearDetectionMeshNames", "0", 0, "")
    assert client.call("simGetDetections", "0", 0, "") == []


def test_orientations_are_relative_to_the_camera(client):
    half = math.sqrt(0.5)
    left = {"w_val": half, "x_val": 0.0, "y_val": 0.0, "z_val": -half}  # 90 degrees, NED
    client.call("simSetVehiclePose", pose(10.0, 10.0, 0.0, left), True, "")
    client.call("simAddDetectionFilterMeshName", "0", 0, "box", "")
    (found,) = client.call("simGetDetections", "0", 0, "")
    turn = found["relative_pose"]["orientation"]
    assert [turn[f"{axis}_val"] for axis in "wxyz"] == pytest.approx([half, 0.0, 0.0, half])
