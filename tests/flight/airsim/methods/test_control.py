"""The handshake, control, the clock and recordings."""

import pytest

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


def test_plots_messages_and_gains_are_accepted_without_effect(start, caplog):
    _, client = start()
    assert client.call("simPrintLogMessage", "height", "2", 1) is None
    assert client.call("simPlotPoints", [], [1.0, 0.0, 0.0, 1.0], 10.0, -1.0, False) is None
    assert client.call("simRunConsoleCommand", "stat fps") is False
    gains = ([1.0] * 3, [0.0] * 3, [0.0] * 3, "")
    assert client.call("setVelocityControllerGains", *gains) is None
    assert "gains are settings of the dynamics" in caplog.text
