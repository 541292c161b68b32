"""Methods without effect answer, and still check their arguments."""

import pytest


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
    with pytest.raises(RuntimeError, match="kp is not a list"):
        client.call("setVelocityControllerGains", 1, 2, 3)
