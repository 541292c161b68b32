"""Methods of the three dialects: images by hand, cameras, objects, vehicles, weather."""

import struct

import numpy as np
import pytest

from drone_rl.flight.airsim.methods import METHODS, UNSUPPORTED
from tests.flight.airsim.conftest import CV

NAN = float("nan")
LEVEL = {"w_val": 1.0, "x_val": 0.0, "y_val": 0.0, "z_val": 0.0}
SMALL = """{"SimMode": "ComputerVision", "CameraDefaults": {"CaptureSettings": [
  {"ImageType": -1, "Width": 16, "Height": 8, "FOV_Degrees": 90}]}}"""
YAW = {"is_rate": True, "yaw_or_rate": 0.0}


def pose(x, y, z, orientation=LEVEL):
    return {"position": {"x_val": x, "y_val": y, "z_val": z}, "orientation": orientation}


def request(camera="0", kind=0, *, as_float=False, compress=False, **more):
    given = {"image_type": kind, "pixels_as_float": as_float, "compress": compress}
    return {"camera_name": camera, **given, **more}


def test_handshakes_of_both_clients(start):
    _, client = start()
    assert client.call("getServerVersion") == 4
    assert client.call("getMinRequiredClientVersion") == 1
    assert client.call("listVehicles") == ["SimpleFlight"]
    home = client.call("getHomeGeoPoint")
    assert home["latitude"] == pytest.approx(47.641468)
    assert client.call("getSettingsString") == "{}"


def test_the_legacy_pose_is_a_map_in_order(start):
    _, client = start(CV)
    found = client.call("simGetPose")
    assert [*found] == ["position", "orientation"]
    assert [*found["position"].values()] == [0.0, 0.0, 0.0]
    client.call("simSetPose", pose(1.0, 2.0, -3.0), True)
    assert [*client.call("simGetPose")["position"].values()] == [1.0, 2.0, -3.0]


@pytest.mark.parametrize(
    ("more", "channels", "order"),
    [({}, 3, (2, 1, 0)), ({"annotation_name": ""}, 3, (0, 1, 2))],
)
def test_raw_pixels_follow_the_dialect(start, more, channels, order):
    _server, client = start(SMALL)
    png = client.call("simGetImages", [request(compress=True)], "")[0]
    raw = client.call("simGetImages", [request(**more)], "")[0]
    assert len(raw["image_data_uint8"]) == 16 * 8 * channels
    pixels = np.frombuffer(raw["image_data_uint8"], np.uint8).reshape(8, 16, channels)
    from io import BytesIO

    from PIL import Image

    colors = np.asarray(Image.open(BytesIO(png["image_data_uint8"])))[..., :3]
    assert np.array_equal(pixels, colors[..., list(order)])
    assert ("annotation_name" in raw) == bool(more)
    assert raw["image_data_float"] == [] and png["image_data_float"] == []
    assert (raw["width"], raw["height"], raw["camera_name"]) == (16, 8, "0")


def test_legacy_images_have_four_channels(start):
    _, client = start(SMALL)
    legacy = {"camera_id": 0, "image_type": 0, "pixels_as_float": False, "compress": False}
    (found,) = client.call("simGetImages", [legacy])
    assert len(found["image_data_uint8"]) == 16 * 8 * 4
    assert found["image_data_uint8"][3::4] == b"\xff" * (16 * 8)
    assert found["camera_id"] == 0


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


def test_floats_of_images_have_32_bits(start):
    _server, client = start(SMALL)
    number = client.send("simGetImages", [request(kind=1, as_float=True)], "")
    data = b""
    while number not in client.answers:
        part = client.socket.recv(2**16)
        data += part
        client.unpacker.feed(part)
        for _, answered, error, result in client.unpacker:
            client.answers[answered] = (error, result)
    assert data.count(b"\xcb") == 0 or data.count(b"\xca") > 128
    first = client.answers[number][1][0]["image_data_float"][0]
    assert struct.unpack("f", struct.pack("f", first))[0] == first


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
        (([7], ""), "an image request is not a map"),
        (([{"camera_name": "0"}], ""), "no camera_name or image_type"),
        ((7, ""), "requests are not a list"),
        (([request()] * 65, ""), "requests are not a list of at most 64"),
        (([request()], "Drone9"), "Vehicle Sim-API for 'Drone9' is not available"),
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
    assert info["proj_mat"]["matrix"][0][0] == pytest.approx(1.0)
    assert info["proj_mat"]["matrix"][1][1] == pytest.approx(2.0)
    client.call("simSetCameraFov", "0", 120.0, "")
    client.call("simSetCameraPose", "0", pose(0.5, 0.25, -1.0), "")
    info = client.call("simGetCameraInfo", "0", "")
    assert info["fov"] == 120.0
    assert [*info["pose"]["position"].values()] == pytest.approx([0.5, 0.25, -1.0])
    with pytest.raises(RuntimeError, match="fov_degrees=180 is out of range"):
        client.call("simSetCameraFov", "0", 180, "")


def test_objects_and_vehicles_by_name(start):
    _, client = start(SMALL, scene="cubes")
    names = client.call("simListSceneObjects", ".*")
    assert names == ["Ground", "cube_0", "cube_1", "cube_2"]
    before = client.call("simGetObjectPose", "cube_0")
    assert before["position"]["x_val"] == 15.0
    assert client.call("simSetObjectPose", "cube_0", pose(18.0, NAN, NAN), True) is True
    after = client.call("simGetObjectPose", "cube_0")["position"]
    assert (after["x_val"], after["y_val"]) == (18.0, before["position"]["y_val"])
    missing = client.call("simGetObjectPose", "tree")["position"]["x_val"]
    assert missing != missing
    # a vehicle that is put into a cube collects it
    client.call("simSetVehiclePose", pose(18.0, after["y_val"], 0.0), True, "")
    gone = client.call("simGetObjectPose", "cube_0")["position"]["x_val"]
    assert gone != gone
    client.call("reset")
    assert client.call("simGetObjectPose", "cube_0")["position"]["x_val"] == 15.0
    assert client.call("simSetSegmentationObjectID", "cube_1", 20, False) is True
    assert client.call("simGetSegmentationObjectID", "cube_1") == 20
    assert client.call("simSetSegmentationObjectID", "tree", 20, False) is False
    assert client.call("simGetSegmentationObjectID", "tree") == -1


def test_spawned_objects(start):
    _, client = start(SMALL)
    one = {"x_val": 2.0, "y_val": 2.0, "z_val": 2.0}
    assert (
        client.call("simSpawnObject", "rock", "Sphere", pose(9.0, 0.0, -2.0), one, False) == "rock"
    )
    assert client.call("simGetObjectPose", "rock")["position"]["x_val"] == 9.0
    assert client.call("simDestroyObject", "rock") is True
    with pytest.raises(RuntimeError, match=r"scale=.* is not supported"):
        client.call("simSpawnObject", "r", "Cube", pose(9.0, 0.0, -2.0), {**one, "x_val": 1.0})


def test_two_vehicles_fly_on_their_own(start):
    text = '{"Vehicles": {"A": {"VehicleType": "SimpleFlight", "X": 0}, "B": {"X": 8, "Y": 2}}}'
    _, client = start(text)
    assert client.call("listVehicles") == ["A", "B"]
    for name in "AB":
        client.call("enableApiControl", True, name)
    flights = [client.send("takeoff", 20.0, name) for name in "AB"]
    assert [client.receive(number) for number in flights] == [(None, True)] * 2
    client.call("moveToPosition", 5.0, 0.0, -3.0, 2.0, 60.0, 0, YAW, -1.0, 1.0, "B")
    a, b = (client.call("simGetVehiclePose", name)["position"] for name in "AB")
    assert abs(a["x_val"]) < 0.3 and b["x_val"] == pytest.approx(5.0, abs=0.6)
    world = client.call("simGetObjectPose", "B")["position"]
    assert world["x_val"] == pytest.approx(b["x_val"] + 8.0)
    assert client.call("simAddVehicle", "C", "simpleflight", pose(0.0, 5.0, 0.0), "") is True
    assert client.call("listVehicles") == ["A", "B", "C"]
    with pytest.raises(RuntimeError, match="vehicle 'C' is there already"):
        client.call("simAddVehicle", "C", "simpleflight", pose(0.0, 5.0, 0.0), "")
    assert client.call("simAddVehicle", "D", "car", pose(0.0, 5.0, 0.0), "") is False


def test_all_movements_run(start):
    _, client = start()
    client.call("enableApiControl", True)
    client.call("takeoff", 20.0)
    path = [
        {"x_val": 1.0, "y_val": 1.0, "z_val": -2.0},
        {"x_val": 2.0, "y_val": 0.0, "z_val": -3.0},
    ]
    place = client.call("getMultirotorState")["gps_location"]
    geo = (place["latitude"], place["longitude"], place["altitude"] + 1.0)
    for method, args in {
        "moveByVelocity": (1.0, 0.0, 0.0, 0.3, 0, YAW),
        "moveByVelocityZ": (1.0, 0.0, -3.0, 0.3, 1, YAW),
        "moveByVelocityBodyFrame": (1.0, 0.0, 0.0, 0.3, 0, YAW),
        "moveByVelocityZBodyFrame": (1.0, 0.0, -3.0, 0.3, 0, YAW),
        "moveOnPath": (path, 2.0, 60.0, 0, YAW, -1.0, 1.0),
        "moveToGPS": (*geo, 2.0, 60.0, 0, YAW, -1.0, 1.0),
        "moveToZ": (-3.0, 1.0, 60.0, YAW, -1.0, 1.0),
        "rotateToYaw": (30.0, 20.0, 5.0),
        "rotateByYawRate": (20.0, 0.3),
        "moveByRollPitchYawZ": (0.0, 0.05, 0.0, -3.0, 0.3),
        "moveByRollPitchYawThrottle": (0.0, 0.0, 0.0, 0.6, 0.2),
        "moveByRollPitchYawrateThrottle": (0.0, 0.0, 0.1, 0.6, 0.2),
        "moveByRollPitchYawrateZ": (0.0, 0.0, 0.1, -3.0, 0.2),
        "moveByAngleRatesZ": (0.0, 0.0, 0.1, -3.0, 0.2),
        "moveByAngleRatesThrottle": (0.0, 0.0, 0.1, 0.6, 0.1),
        "moveByAngleZ": (0.05, 0.0, -3.0, 0.0, 0.3),
        "moveByAngle": (0.05, 0.0, -3.0, 0.0, 0.3),
        "moveByAngleThrottle": (0.0, 0.0, 0.6, 0.1, 0.1),
        "moveByMotorPWMs": (0.59, 0.59, 0.59, 0.59, 0.1),
        "moveByManual": (2.0, 2.0, -3.0, 0.3, 0, YAW),
        "hover": (),
        "goHome": (3e38,),
        "land": (60.0,),
    }.items():
        assert client.call(method, *args) is True, method
    assert client.call("moveByVelocity", 1.0, 0.0, 0.0, 0.0, 0, YAW) is True
    assert client.call("moveByVelocityZ", 1.0, 0.0, 0.0, 0.0, 0, YAW) is False


def test_movements_without_api_control_return_false(start):
    _, client = start()
    assert client.call("isApiControlEnabled", "") is False
    assert client.call("takeoff", 20.0, "") is False
    assert client.call("armDisarm", True, "") is False


@pytest.mark.parametrize(
    ("method", "args", "message"),
    [
        ("moveToPosition", (NAN, 0.0, 0.0, 1.0), "x=nan is out of range"),
        ("moveToPosition", (0.0, 0.0, -2.0, -1.0), "speed=-1"),
        ("moveByVelocity", ("fast", 0.0, 0.0, 1.0), "vx='fast' is not a number"),
        ("moveByVelocity", (500.0, 0.0, 0.0, 1.0), "vx=500"),
        ("moveOnPath", ([], 1.0), "path is not a list of 1"),
        ("moveByRollPitchYawZ", (9.0, 0.0, 0.0, -2.0, 1.0), "roll="),
        ("simSetWeatherParameter", (0, 0.5), "of the weather only fog"),
        ("simSetWind", ({"x_val": 99.0, "y_val": 0.0, "z_val": 0.0},), "wind=.*out of range"),
        ("simSetTimeOfDay", (True, "noon"), "has no time"),
        ("startRecording", (), "no folder for recordings"),
        ("setVelocityControllerGains", (1, 2, 3), "kp is not a list"),
    ],
)
def test_wrong_arguments_are_one_error(start, method, args, message):
    _, client = start()
    client.call("enableApiControl", True)
    with pytest.raises(RuntimeError, match=message):
        client.call(method, *args)


def test_weather_light_and_wind(start):
    _, client = start(SMALL, scene="cubes")
    plain = client.call("simGetImage", "0", 0, "")
    client.call("simEnableWeather", True)
    client.call("simSetWeatherParameter", 7, 0.8)
    foggy = client.call("simGetImage", "0", 0, "")
    assert foggy != plain
    client.call("simEnableWeather", False)
    assert client.call("simGetImage", "0", 0, "") == plain
    client.call("simSetTimeOfDay", True, "2018-02-12 23:00:00", False, 1.0, 60.0, True)
    assert client.call("simGetImage", "0", 0, "") != plain


def test_wind_pushes_the_drone(start):
    _, client = start('{"Wind": {"X": 0, "Y": 6, "Z": 0}}')
    client.call("enableApiControl", True)
    client.call("takeoff", 20.0)
    assert client.call("getMultirotorState")["kinematics_estimated"]["position"]["y_val"] > 0.05


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


def test_no_method_is_both_supported_and_not():
    assert not METHODS.keys() & UNSUPPORTED.keys()
