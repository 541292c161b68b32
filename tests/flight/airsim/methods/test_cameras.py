"""Poses and fields of view of cameras."""

import pytest

from tests.flight.airsim.conftest import SMALL, pose


def test_camera_poses_and_fields_of_view(start):
    _, client = start(SMALL)
    info = client.call("simGetCameraInfo", "0", "")
    assert info["fov"] == 90.0
    assert info["pose"]["position"]["x_val"] == pytest.approx(0.4)
    # tan(45 degrees) is 1, the image is twice as wide as high; times (north, east, down, 1)
    assert info["proj_mat"]["matrix"] == [
        pytest.approx(row) for row in ([0, 1, 0, 0], [0, 0, -2, 0], [0, 0, 0, 10], [-1, 0, 0, 0])
    ]
    client.call("simSetCameraFov", "0", 120.0, "")
    client.call("simSetCameraPose", "0", pose(0.5, 0.25, -1.0), "")
    info = client.call("simGetCameraInfo", "0", "")
    assert info["fov"] == 120.0
    assert [*info["pose"]["position"].values()] == pytest.approx([0.5, 0.25, -1.0])
    client.call("simSetCameraFov", "0", 180, "")
    assert client.call("simGetCameraInfo", "0", "")["fov"] == 170.0


def test_cameras_of_the_1_1_9_client(start):
    _, client = start(SMALL)
    right = {"w_val": 0.5**0.5, "x_val": 0.0, "y_val": 0.0, "z_val": 0.5**0.5}
    client.call("setCameraOrientation", 0, right)
    info = client.call("getCameraInfo", 0)
    assert info.keys() == {"pose", "fov"}  # its client reads no other map
    assert info["pose"]["orientation"]["z_val"] == pytest.approx(0.5**0.5)
