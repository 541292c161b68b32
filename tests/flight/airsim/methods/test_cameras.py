"""Poses and fields of view of cameras."""

import pytest

from tests.flight.airsim.conftest import SMALL, pose


def test_camera_poses_and_fields_of_view(start):
    _, client = start(SMALL)
    info = client.call("simGetCameraInfo", "0", "")
    assert info["fov"] == 90.0
    assert info["pose"]["position"]["x_val"] == pytest.approx(0.4)
    assert info["proj_mat"]["matrix"][0][0] == pytest.approx(1.0)
    assert info["proj_mat"]["matrix"][1][1] == pytest.approx(2.0)
    client.call("simSetCameraFov", "0", 120.0, "")
    client.call("simSetCameraPose", "0", pose(0.5, 0.25, -1.0), "")
    info = client.call("simGetCameraInfo", "0", "")
    assert info["fov"] == 120.0
    assert [*info["pose"]["position"].values()] == pytest.approx([0.5, 0.25, -1.0])
    with pytest.raises(RuntimeError, match="fov_degrees=180 is out of range"):
        client.call("simSetCameraFov", "0", 180, "")
