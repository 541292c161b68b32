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


@pytest.mark.parametrize(
    ("method", "args", "message"),
    [
        ("moveToPosition", (NAN, 0.0, 0.0, 1.0), "x=nan is not a number"),
        ("moveByVelocity", ("fast", 0.0, 0.0, 1.0), "vx='fast' is not a number"),
        ("moveOnPath", ([], 1.0), "path is not a list of 1"),
    ],
)
def test_wrong_arguments_are_one_error(start, method, args, message):
    _, client = start()
    client.call("enableApiControl", True)
    with pytest.raises(RuntimeError, match=message):
        client.call(method, *args)


@pytest.mark.parametrize(
    ("method", "args", "limited"),
    [
        ("moveByVelocity", (500.0, 0.0, 0.0, 0.1), "vx is limited to 100"),
        ("moveByManual", (1e6, 1e6, -2.0, 0.1, 0, YAW), "vx_max is limited to 100"),
        ("moveToPosition", (50.0, 0.0, -2.0, 1e3, 0.1), "velocity is limited to 100"),
        ("moveByRollPitchYawZ", (9.0, 0.0, 100.0, -2.0, 0.1), "roll is limited to 1.5708"),
        ("moveByMotorPWMs", (0.6, 0.6, 0.6, 1.6, 0.1), "rear_right is limited to 1"),
        ("moveByAngleRatesThrottle", (99.0, 0.0, 0.0, 0.6, 0.1), "roll_rate is limited to 62.8319"),
        ("rotateByYawRate", (1e5, 0.1), "yaw_rate is limited to 3600"),
    ],
)
def test_values_beyond_limits_are_limited_with_one_log_line(start, caplog, method, args, limited):
    _, client = start()
    client.call("enableApiControl", True)
    client.call("takeoff", 20.0)
    for _ in range(3):
        assert client.call(method, *args) is (method != "moveToPosition")
    assert caplog.text.count(limited) == 1


@pytest.mark.parametrize("speed", [0.0, -3.0])
def test_a_movement_that_never_arrives_is_refused(start, speed):
    _, client = start()
    client.call("enableApiControl", True)
    with pytest.raises(Exception, match=r"velocity=.* is invalid; give a speed above 0"):
        client.call("moveToPosition", 1.0, 0.0, -3.0, speed, 3e38)


def test_waiting_for_the_last_task_of_the_1_2_client(start):
    _, client = start()
    client.call("enableApiControl", True)
    rising = client.send("takeoff", 20.0)
    assert client.call("waitOnLastTask", float("nan")) is True
    assert client.receive(rising) == (None, True)
    assert client.call("waitOnLastTask", float("nan")) is True
