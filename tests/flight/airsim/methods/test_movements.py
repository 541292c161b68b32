"""All movements, and their wrong arguments."""

import pytest

from tests.flight.airsim.conftest import NAN, YAW


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
    assert client.call("moveByManual", 2.0, 2.0, -3.0, -1.0, 0, YAW) is True


def test_movements_have_airsims_frames_and_signs(start):
    """North, east and down, relative to the start; yaw to the right; pitch up flies backward."""
    _, client = start('{"Vehicles": {"A": {"X": 5, "AllowAPIAlways": true}}}')

    def place():
        return [*client.call("simGetVehiclePose")["position"].values()]

    client.call("takeoff")
    assert place() == pytest.approx([0.0, 0.0, -2.0], abs=0.15)
    with pytest.raises(RuntimeError, match="lookahead=0 is too short"):
        client.call("moveToPosition", 4.0, 3.0, -3.0, 3.0, 60.0, 0, YAW, 0.0)
    client.call("moveToPosition", 4.0, 3.0, -3.0, 3.0)
    assert place() == pytest.approx([4.0, 3.0, -3.0], abs=0.6)
    client.call("moveByVelocity", 0.0, 2.0, -1.0, 2.0)
    assert place()[1] > 4.5 and place()[2] < -4.0 and place()[0] == pytest.approx(4.0, abs=0.6)
    with pytest.raises(RuntimeError, match="can't take off while moving"):
        client.call("takeoff")
    client.call("rotateToYaw", 90.0)
    turned = client.call("simGetVehiclePose")["orientation"]
    assert turned["z_val"] == pytest.approx(2**-0.5, abs=0.05)
    east = place()[1]
    client.call("moveByVelocityBodyFrame", 2.0, 0.0, 0.0, 2.0)
    assert place()[1] - east > 1.0
    client.call("rotateToYaw", 0.0)
    client.call("hover")
    north = place()[0]
    client.call("moveByRollPitchYawZ", 0.0, 0.17, 0.0, -3.0, 1.5)
    assert place()[0] < north - 0.3
    first, second = client.send("moveToZ", -50.0, 1.0), client.send("goHome")
    assert client.receive(first) == (None, False) and client.receive(second) == (None, True)
    assert place() == pytest.approx([0.0, 0.0, 0.0], abs=0.6)


def test_a_disarmed_vehicle_names_the_method_that_arms(start):
    _, client = start()
    client.call("enableApiControl", True)
    client.call("armDisarm", False)
    with pytest.raises(RuntimeError, match=r"not armed; call armDisarm\(True\)"):
        client.call("takeoff", 20.0)


def test_movements_without_api_control_return_false(start):
    _, client = start()
    assert client.call("isApiControlEnabled", "") is False
    assert client.call("takeoff", 20.0, "") is False
    assert client.call("armDisarm", True, "") is False
    client.call("enableApiControl", True)
    assert client.call("armDisarm", True, "") is True
    assert client.call("moveToZ", -1.5, 1.0) is True  # movements lift off
    client.call("reset")
    assert client.call("isApiControlEnabled", "") is False
    assert [*client.call("simGetVehiclePose")["position"].values()] == [0.0, 0.0, 0.0]


def test_wrong_arguments_are_one_error_and_great_ones_are_limited_with_one_line(start, caplog):
    _, client = start()
    client.call("enableApiControl", True)
    for method, args, message in (
        ("moveToPosition", (NAN, 0.0, 0.0, 1.0), "x=nan is not a number"),
        ("moveByVelocity", ("fast", 0.0, 0.0, 1.0), "vx='fast' is not a number"),
        ("moveOnPath", ([], 1.0), "path is not a list of 1"),
        ("moveToPosition", (1.0, 0.0, -3.0, 0.0, 3e38), "velocity=0 is invalid; give a speed"),
    ):
        with pytest.raises(RuntimeError, match=message):
            client.call(method, *args)
    client.call("takeoff", 20.0)
    for method, args, limited in (
        ("moveByVelocity", (500.0, 0.0, 0.0, 0.1), "vx is limited to 100"),
        ("moveByManual", (1e6, 1e6, -2.0, 0.1, 0, YAW), "vx_max is limited to 100"),
        ("moveToPosition", (50.0, 0.0, -2.0, 1e3, 0.1), "velocity is limited to 100"),
        ("moveByRollPitchYawZ", (9.0, 0.0, 100.0, -2.0, 0.1), "roll is limited to 1.5708"),
        ("moveByMotorPWMs", (0.6, 0.6, 0.6, 1.6, 0.1), "rear_right is limited to 1"),
        ("rotateByYawRate", (1e5, 0.1), "yaw_rate is limited to 3600"),
    ):
        for _ in range(2):
            assert client.call(method, *args) is (method != "moveToPosition")
        assert caplog.text.count(limited) == 1


def test_waiting_for_the_last_task_of_the_1_2_client(start):
    _, client = start()
    client.call("enableApiControl", True)
    rising = client.send("takeoff", 20.0)
    assert client.call("waitOnLastTask", float("nan")) is True
    assert client.receive(rising) == (None, True)
    assert client.call("waitOnLastTask", float("nan")) is True
