"""The handshake, control, the clock and recordings."""

import pytest

from drone_rl.config.commands import ServeSettings
from drone_rl.flight.airsim.methods import METHODS, UnknownMethodError, call, suggestion
from drone_rl.flight.airsim.settings_file import parse_settings
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.errors import InputError
from tests.flight.airsim.conftest import Client


def test_handshakes_of_both_clients(start):
    _, client = start()
    assert client.call("getServerVersion") == 4
    assert client.call("getMinRequiredClientVersion") == 1
    assert client.call("listVehicles") == ["SimpleFlight"]
    home = client.call("getHomeGeoPoint")
    assert home["latitude"] == pytest.approx(47.641468)
    assert client.call("getSettingsString") == "{}"


def test_without_a_folder_nothing_is_recorded(start):
    _, client = start()
    with pytest.raises(RuntimeError, match="no folder for recordings"):
        client.call("startRecording")
    assert client.call("isRecording") is False


@pytest.mark.parametrize("end", [("cancelLastTask",), ("enableApiControl", False)])
def test_a_movement_that_is_cancelled_while_time_is_paused_is_answered(start, end):
    _, client = start()
    client.call("enableApiControl", True)
    client.call("simPause", True)
    movement = client.send("takeoff", 20.0)
    client.call(*end)
    client.socket.settimeout(5)
    assert client.receive(movement) == (None, False)


def test_a_pause_ends_the_wait_of_continuing(start):
    server, client = start(clock="wall")
    waiting, other = client.send("simContinueForTime", 600.0), Client(server.address[1])
    while other.call("getMultirotorState")["timestamp"] == 0:
        pass
    other.call("simPause", True)
    client.socket.settimeout(5)
    assert client.receive(waiting) == (None, None)
    other.close()


def test_plots_and_messages_are_accepted(start):
    _, client = start()
    assert client.call("simPrintLogMessage", "height", "2", 1) is None
    assert client.call("simPlotPoints", [], [1.0, 0.0, 0.0, 1.0], 10.0, -1.0, False) is None
    assert client.call("simRunConsoleCommand", "stat fps") is False


def test_gains_change_no_flight_and_are_logged(start, caplog):
    _, client = start()
    gains = ([1.0] * 3, [0.0] * 3, [0.0] * 3, "")
    assert client.call("setVelocityControllerGains", *gains) is None
    assert "gains are settings of the dynamics" in caplog.text


@pytest.fixture(scope="module")
def simulation():
    found = Simulation(
        parse_settings('{"Vehicles": {"A": {}, "B": {}}}'), ServeSettings(scene="empty")
    )
    yield found
    found.close()


def test_all_features_are_registered():
    one_of_each = {"ping", "takeoff", "getMultirotorState", "simGetImages", "simGetCameraInfo"}
    assert one_of_each | {"simSpawnObject", "simPlotPoints"} <= METHODS.keys()
    assert len(METHODS) > 90


def test_missing_arguments_are_an_error_and_more_are_ignored(simulation):
    with pytest.raises(InputError, match="moveToZ was called with 1 arguments; give 2 or more"):
        call(simulation, "moveToZ", [1.0])
    assert call(simulation, "ping", [1, 2, 3]) is True


def test_vehicles_are_named_by_text_or_bytes(simulation):
    assert call(simulation, "isApiControlEnabled", ["B"]) is False
    assert call(simulation, "isApiControlEnabled", [b"B"]) is False
    assert call(simulation, "isApiControlEnabled", []) is False
    with pytest.raises(InputError, match="Vehicle API for 'C' is not available"):
        call(simulation, "isApiControlEnabled", ["C"])
    with pytest.raises(InputError, match="Vehicle Sim-API for 'C' is not available"):
        call(simulation, "simGetVehiclePose", ["C"])
    with pytest.raises(InputError, match="vehicle_name=7 is not a text"):
        call(simulation, "isApiControlEnabled", [7])


def test_unknown_methods_have_a_suggestion(simulation):
    with pytest.raises(UnknownMethodError):
        call(simulation, "takeof", [])
    assert "takeoff" in suggestion("takeof")
    with pytest.raises(InputError, match="getCarState is not supported: this server has no cars"):
        call(simulation, "getCarState", [])
