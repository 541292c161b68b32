"""Time, calls that wait, and several clients."""

import time

import pytest

from tests.flight.airsim.conftest import SMALL, Client, request


def test_lockstep_time_stands_still_between_calls(start):
    _, client = start()
    one = client.call("getMultirotorState")["timestamp"]
    time.sleep(0.1)
    assert client.call("getMultirotorState")["timestamp"] == one
    client.call("simContinueForTime", 1.0)
    passed = client.call("getMultirotorState")["timestamp"] - one
    assert passed == pytest.approx(1e9, abs=2.2e7)
    assert client.call("simIsPaused") is True


def test_wall_clock_follows_the_time_of_day(start):
    _server, client = start('{"ClockSpeed": 5}', clock="wall")
    one, begin = client.call("timestampNow"), time.monotonic()
    time.sleep(0.5)
    passed = (client.call("timestampNow") - one) / 1e9
    assert passed == pytest.approx(5 * (time.monotonic() - begin), rel=0.3)
    client.call("simPause", True)
    one = client.call("timestampNow")
    time.sleep(0.1)
    assert client.call("timestampNow") == one


def test_a_hundred_clients_get_their_own_answers(start):
    """Half of them die with requests unanswered."""
    server, first = start(SMALL)
    clients = [Client(server.address[1]) for _ in range(100)]
    calls = []
    for i, client in enumerate(clients):
        images = client.send("simGetImages", [request()], "")
        calls.append((images, client.send("getMultirotorState", f"Drone{i}")))
        if i % 2:
            client.close()
    for i, (images, state) in [*enumerate(calls)][::2]:
        error, found = clients[i].receive(images)
        assert error is None and len(found[0]["image_data_uint8"]) == 16 * 8 * 3
        assert f"Vehicle API for 'Drone{i}' is not available" in clients[i].receive(state)[0]
    assert first.call("ping") is True
    assert all(client.call("ping") for client in clients[::2])
    for client in clients:
        client.close()
