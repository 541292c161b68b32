"""Objects, added vehicles, wind, weather and light."""

import math

import pytest

from tests.flight.airsim.conftest import CV, NAN, SMALL, YAW, pose


def test_objects_and_vehicles_by_name(start):
    _, client = start(SMALL, scene="cubes")
    names = client.call("simListSceneObjects", ".*")
    assert names == ["Ground", "cube_0", "cube_1", "cube_2", "SkySphere", "ComputerVision"]
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
    assert client.call("simGetObjectScale", "rock") == one
    three = {"x_val": 3.0, "y_val": 3.0, "z_val": 3.0}
    assert client.call("simSetObjectScale", "rock", three) is True
    assert client.call("simGetObjectScale", "rock") == three
    assert client.call("simSetObjectScale", "Ground", three) is False
    assert client.call("simGetObjectScale", "Ground")["x_val"] == 1.0
    assert client.call("simDestroyObject", "rock") is True
    several = {"x_val": 1.0, "y_val": 2.0, "z_val": 4.0}
    assert "1M_Cube_Chamfer" in client.call("simListAssets")
    client.call("simSpawnObject", "r", "1M_Cube_Chamfer", pose(9.0, 0.0, -2.0), several)
    assert client.call("simGetObjectScale", "r")["x_val"] == pytest.approx(2.0)


def test_object_poses_are_relative_to_the_start_of_vehicles(start):
    """As AirSim's: what is at a vehicle's place has its pose."""
    for text in (None, CV):
        _, client = start(text, scene="cubes")
        client.call("simSetObjectPose", "cube_1", pose(0.0, 0.0, 0.0), True)
        assert client.call("simGetObjectPose", "cube_1")["position"]["z_val"] == pytest.approx(0.0)
        vehicle = client.call("listVehicles")[0]
        there = client.call("simGetObjectPose", vehicle)["position"]
        assert [*there.values()] == pytest.approx([0.0, 0.0, 0.0])
        altitude = client.call("getHomeGeoPoint")["altitude"]
        place = client.call("getMultirotorState")["gps_location"]
        assert place["altitude"] == pytest.approx(altitude, abs=1e-6)


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


def test_weather_and_light(start, caplog):
    _, client = start(SMALL, scene="cubes")
    plain = client.call("simGetImage", "0", 0, "")
    client.call("simSetWeatherParameter", 7, 0.8)
    assert client.call("simSetWeatherParameter", 0, 0.5) is None
    assert caplog.text.count("of the weather only fog is shown") == 1
    assert client.call("simGetImage", "0", 0, "") == plain
    client.call("simEnableWeather", True)
    foggy = client.call("simGetImage", "0", 0, "")
    assert foggy != plain
    client.call("simSetTimeOfDay", True, "2018-02-12 23:00:00", False, 1.0, 60.0, True)
    client.call("simSetTimeOfDay", False)
    assert client.call("simGetImage", "0", 0, "") == foggy
    client.call("simEnableWeather", False)
    assert client.call("simGetImage", "0", 0, "") == plain
    client.call("simSetTimeOfDay", True, "2018-02-12 23:00:00")
    assert client.call("simGetImage", "0", 0, "") != plain
    with pytest.raises(RuntimeError, match="has no time"):
        client.call("simSetTimeOfDay", True, "2018-02-12 99:99:00")


@pytest.mark.parametrize("mode", ["Multirotor", "ComputerVision"])
def test_the_pose_of_a_vehicle_as_an_object_is_in_the_world(start, mode):
    text = f'{{"SimMode": "{mode}", "Vehicles": {{"A": {{"X": 8, "Y": 2, "Z": -1}}}}}}'
    _, client = start(text)
    client.call("simAddVehicle", "B", mode.replace("Multirotor", "SimpleFlight"), pose(8, 4, -1))
    found = client.call("simGetObjectPose", "A")
    assert [*found["position"].values()] == pytest.approx([8.0, 2.0, -1.0])
    added = client.call("simGetObjectPose", "B")["position"]
    assert [*added.values()] == pytest.approx([8.0, 4.0, -1.0])
    assert client.call("simSetObjectPose", "A", found, True) is True
    assert client.call("simGetObjectPose", "A") == found
    assert client.call("simSetObjectPose", "A", pose(9.0, NAN, -4.0), True) is True
    moved = client.call("simGetObjectPose", "A")["position"]
    assert [*moved.values()] == pytest.approx([9.0, 2.0, -4.0])


@pytest.mark.parametrize("teleport", [True, False])
def test_a_vehicle_that_is_moved_as_an_object_collides_unless_it_is_teleported(start, teleport):
    _, client = start()
    vehicle = client.call("listVehicles")[0]
    client.call("simSetObjectPose", vehicle, pose(0.0, 0.0, -5.0), True)
    client.call("simSetObjectPose", vehicle, pose(0.0, 0.0, 5.0), teleport)
    assert client.call("simGetCollisionInfo", "")["has_collided"] is not teleport


@pytest.mark.parametrize(("hour", "north", "west"), [(6, 0, -1), (12, -1, 0), (18, 0, 1)])
def test_the_sun_rises_in_the_east_and_passes_the_south(start, hour, north, west):
    server, client = start(SMALL)
    given = []
    server.simulation.stage.set_sun = lambda *angles: given.append(math.radians(angles[1]))
    client.call("simSetTimeOfDay", True, f"2018-02-12 {hour:02}:00:00")
    assert (math.cos(given[0]), math.sin(given[0])) == pytest.approx((north, west), abs=1e-9)


def test_wind_pushes_the_drone(start):
    _, client = start('{"Wind": {"X": 0, "Y": 6, "Z": 0}}')
    client.call("enableApiControl", True)
    client.call("takeoff", 20.0)
    assert client.call("getMultirotorState")["kinematics_estimated"]["position"]["y_val"] > 0.05


def test_a_fast_vehicle_touches_what_it_passes(start):
    """At 400 m/s it moves 8.4 m in a control period; the cube is touched from 1.65 m on."""
    _, client = start(scene="cubes")
    cube = client.call("simGetObjectPose", "cube_0")["position"]
    state = {
        **pose(cube["x_val"] - 4.2, cube["y_val"], cube["z_val"]),
        "linear_velocity": {"x_val": 400.0, "y_val": 0.0, "z_val": 0.0},
        "angular_velocity": {"x_val": 0.0, "y_val": 0.0, "z_val": 0.0},
    }
    client.call("simSetKinematics", state, True)
    client.call("simContinueForTime", 0.021)
    assert client.call("simGetCollisionInfo", "")["object_name"] == "cube_0"
