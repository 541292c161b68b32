"""The handshake, control, the clock and recordings."""

import pytest


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
