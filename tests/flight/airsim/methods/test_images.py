"""Images by hand, in the orders of channels of the three dialects."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tests.flight.airsim.conftest import SMALL, pose, request


def raw(client, channels, sent):
    (found,) = client.call("simGetImages", [sent])
    assert found["image_data_float"] == [] and (found["width"], found["height"]) == (16, 8)
    return found, np.frombuffer(found["image_data_uint8"], np.uint8).reshape(8, 16, channels)


def test_raw_pixels_follow_the_dialect(start):
    """Blue first of airsim, red first of Cosys, and red first with opacity of old versions."""
    _, client = start(SMALL)
    content = client.call("simGetImages", [request(compress=True)], "")[0]["image_data_uint8"]
    colors = np.asarray(Image.open(BytesIO(content)))
    found, pixels = raw(client, 3, request())
    assert np.array_equal(pixels, colors[..., 2::-1])
    assert found["camera_name"] == "0" and "annotation_name" not in found
    found, pixels = raw(client, 3, request(annotation_name=""))
    assert np.array_equal(pixels, colors[..., :3]) and found["annotation_name"] == ""
    legacy = {"camera_id": 0, "image_type": 0, "pixels_as_float": False, "compress": False}
    found, pixels = raw(client, 4, legacy)
    assert np.array_equal(pixels, colors) and found["camera_id"] == 0
    _, four = start(SMALL, raw_channels=4)
    found, pixels = raw(four, 4, request())
    assert np.array_equal(pixels, colors) and found["camera_name"] == "0"


def test_depth_as_numbers_by_hand(start):
    """From 10 m up the ground under the camera that looks down is 10 - 0.1 m away."""
    _, client = start(SMALL)
    client.call("simSetVehiclePose", pose(0.0, 0.0, -10.0), True, "")
    (found,) = client.call("simGetImages", [request("bottom_center", 1, as_float=True)], "")
    assert found["image_data_uint8"] == b""
    assert len(found["image_data_float"]) == 128
    height = 10.0 + 1.0 - 0.1  # the scene starts vehicles without dynamics at 1 m
    assert found["image_data_float"][60] == pytest.approx(height, abs=0.01)
    assert found["camera_position"]["z_val"] == pytest.approx(-9.9, abs=1e-5)


def test_infrared_shows_segmentation_ids_in_gray(start):
    _, client = start(SMALL)
    client.call("simSetSegmentationObjectID", "Ground", 51, False)
    raw, numbers = (
        client.call("simGetImages", [request("3", 7, as_float=is_float)], "")[0]
        for is_float in (False, True)
    )
    assert raw["image_type"] == numbers["image_type"] == 7
    assert raw["image_data_uint8"] == b"\x33" * (16 * 8 * 3)
    assert numbers["image_data_float"] == pytest.approx([0.2] * 128)
    pixels = np.asarray(Image.open(BytesIO(client.call("simGetImage", "3", 7, ""))))
    assert (pixels == (51, 51, 51, 255)).all()


def test_several_cameras_and_types_in_one_call(start):
    _, client = start(SMALL)
    wanted = [request(camera, kind) for camera in "01234" for kind in range(7)]
    found = client.call("simGetImages", wanted, "")
    assert [(f["camera_name"], f["image_type"]) for f in found] == [
        (w["camera_name"], w["image_type"]) for w in wanted
    ]
    assert client.call("simGetImage", "bottom_center", 0, "").startswith(b"\x89PNG")
    assert client.call("simGetImage", 0, 0).startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (([request("side")], ""), "camera 'side' is unknown"),
        (([request(kind=9)], ""), "image_type=9 is not supported"),
        (([request(kind="rgb")], ""), "image_type='rgb' is not a number"),
        (([request()] * 65, ""), "requests are not a list of at most 64"),
        (([request()], "Drone9"), "Vehicle API for 'Drone9' is not available"),
    ],
)
def test_wrong_image_requests(start, args, message):
    _, client = start(SMALL)
    with pytest.raises(RuntimeError, match=message):
        client.call("simGetImages", *args)


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
