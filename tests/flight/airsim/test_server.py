"""The protocol byte by byte, calls that wait, several clients, and crafted bytes."""

import contextlib
import socket
import time

import msgpack
import pytest

from drone_rl.flight.airsim.server import MAX_MESSAGE, serve
from drone_rl.utils.errors import InputError
from tests.flight.airsim.conftest import CV, Client

PING = bytes([0x94, 0x00, 0x00, 0xA4, *b"ping", 0x90])
PONG = bytes([0x94, 0x01, 0x00, 0xC0, 0xC3])
YAW = {"is_rate": True, "yaw_or_rate": 0.0}


def test_first_message_of_real_clients(start):
    server, _ = start()
    with socket.create_connection(server.address, timeout=10) as raw:
        for byte in PING:  # in pieces
            raw.sendall(bytes([byte]))
        assert raw.recv(100) == PONG
        raw.sendall(PING + PING)
        answer = b""
        while len(answer) < 10:
            answer += raw.recv(100)
        assert answer == PONG + PONG


def test_errors_have_the_words_of_airsim(start):
    _, client = start()
    error, _ = client.receive(client.send("fly"))
    assert error.startswith("rpclib: server could not find function 'fly' with argument count 0.")
    error, _ = client.receive(client.send("getMultirotorState", "Drone2"))
    assert error.startswith(
        "rpclib: function 'getMultirotorState' (called with 1 arg(s)) threw an exception. The "
        "exception contained this information: Vehicle API for 'Drone2' is not available."
    )
    error, _ = client.receive(client.send("getLidarData", "", ""))
    assert "getLidarData is not supported: this server has no lidar; use depth images" in error
    error, _ = client.receive(client.send("moveToZ", 1.0))
    assert "moveToZ was called with 1 arguments; give 2 or more" in error
    assert client.call("ping") is True


def test_a_movement_is_answered_when_it_ends(start):
    _, client = start()
    client.call("enableApiControl", True, "")
    rising = client.send("takeoff", 20.0, "")
    client.call("getMultirotorState", "")  # answered first
    assert rising not in client.answers
    assert client.receive(rising) == (None, True)
    assert client.call("getMultirotorState", "")["landed_state"] == 1


def test_lockstep_repeats(start):
    def fly():
        _, client = start()
        client.call("enableApiControl", True)
        client.call("takeoff", 20.0)
        client.call("moveByVelocity", 3.0, 1.0, 0.0, 2.0, 0, YAW, "")
        sensed = [client.call("getImuData", "", "") for _ in range(2)]
        client.call("simContinueForTime", 0.5)
        return msgpack.packb([sensed, client.call("getMultirotorState", "")])

    assert fly() == fly()


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


def test_a_cancelled_movement_is_answered_false(start):
    _, client = start()
    client.call("enableApiControl", True)
    client.call("takeoff", 20.0)
    args = (0.0, 60.0, 0, YAW, -1.0, 1.0, "")
    first = client.send("moveToPosition", 90.0, 0.0, -2.0, 1.0, 600.0, *args[2:])
    second = client.send("hover", "")
    assert client.receive(second) == (None, True)
    assert client.receive(first) == (None, False)


def test_clients_do_not_disturb_each_other(start):
    server, client = start(CV)
    others = [Client(server.address[1]) for _ in range(20)]
    for i, other in enumerate(others):
        assert other.call("ping") is True
        if i % 2:
            other.close()
    assert client.call("ping") is True
    assert all(other.call("ping") for other in others[::2])
    for other in others:
        other.close()


def test_a_client_that_dies_in_a_call_is_forgotten(start):
    server, client = start()
    client.call("enableApiControl", True)
    client.send("takeoff", 20.0)
    client.close()
    again = Client(server.address[1])
    again.call("simContinueForTime", 5.0)
    assert again.call("getMultirotorState")["landed_state"] == 1
    again.close()


@pytest.mark.parametrize(
    "data",
    [
        b"\xc1",  # no msgpack
        msgpack.packb(7),
        msgpack.packb([]),
        msgpack.packb([5, 1, "ping", []]),
        msgpack.packb([0, 1, 7, []]),
        msgpack.packb([0, 1, "ping", 7]),
        msgpack.packb([0, "1", "ping", []]),
        b"\x91" * 5000,  # nested
        b"\xdd\xff\xff\xff\xff",  # 4 billion items
        b"\xc6\xff\xff\xff\xff",  # 4 GB
    ],
)
def test_crafted_bytes_end_the_connection_alone(start, data):
    server, client = start(CV)
    with socket.create_connection(server.address, timeout=10) as raw:
        raw.sendall(data)
        raw.settimeout(1.0)
        try:
            ended = raw.recv(100) == b""
        except (TimeoutError, ConnectionResetError) as error:
            # a length that has not arrived yet may also leave the connection open
            ended = isinstance(error, ConnectionResetError) or data[0] == 0xC6
        assert ended
    assert client.call("ping") is True


def test_too_much_for_one_message_ends_the_connection(start):
    server, client = start(CV)
    raw = socket.create_connection(server.address, timeout=10)
    with contextlib.closing(raw), pytest.raises(ConnectionError):
        _flood(raw)
    assert client.call("ping") is True


def _flood(raw):
    raw.sendall(b"\xc6" + (2**31 - 1).to_bytes(4, "big"))
    for _ in range(100):
        raw.sendall(bytes(MAX_MESSAGE // 10))
        time.sleep(0.01)


def test_notifications_are_not_answered(start):
    _, client = start(CV)
    client.socket.sendall(msgpack.packb([2, "ping", []]))
    assert client.call("ping") is True
    assert client.answers == {}


def test_a_slow_reader_delays_itself_alone(start):
    server, client = start(CV)
    slow = Client(server.address[1])
    request = {"camera_name": "0", "image_type": 0, "pixels_as_float": True, "compress": False}
    for _ in range(300):
        slow.send("simGetImages", [request], "")
    begin = time.monotonic()
    assert client.call("ping") is True
    assert time.monotonic() - begin < 30
    slow.close()


def test_a_port_in_use_is_one_error():
    with (
        serve(scene="empty", port=0) as server,
        pytest.raises(InputError, match=r"port \d+ of 127.0.0.1 can't be opened .*another port"),
    ):
        serve(scene="empty", port=server.address[1])


def test_wrong_settings_are_refused(tmp_path):
    for given, message in (
        ({"clock": "fast"}, "clock='fast' is unknown"),
        ({"port": 70000}, "port=70000 is out of range"),
        ({"seed": -1}, "seed=-1 is out of range"),
        ({"scene": "moon"}, "scene=moon is unknown"),
        ({"settings": tmp_path / "none.json"}, "can't be read"),
    ):
        with pytest.raises(InputError, match=message):
            serve(**given)


def test_an_open_address_is_warned_about(caplog):
    with serve(scene="empty", port=0, address="0.0.0.0"):
        assert "everybody in that network can control the vehicles" in caplog.text
